"""Every closed form of `bemkit.reference`, solved at several resolutions and compared."""
