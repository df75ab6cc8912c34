"""The RGB camera: pictures of the world, cast and shaded on the processor on request."""
