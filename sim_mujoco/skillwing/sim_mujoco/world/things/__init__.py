"""Objects of worlds, each as outline, height and solid shapes."""
