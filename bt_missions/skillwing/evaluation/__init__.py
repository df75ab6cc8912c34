"""The laboratory above everything that flies: campaigns, ground-truth judge, demo, reports, comparisons."""
