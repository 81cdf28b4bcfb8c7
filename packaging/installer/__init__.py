"""Makes an unpacked trammel known to the printers of a computer, and takes exactly that back."""


class InstallError(Exception):
    """Says what is in the way and what to do about it; nothing was changed."""
