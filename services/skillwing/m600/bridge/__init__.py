"""The bridge between functional layer and resource manager: states and data up, revoked authority down."""
