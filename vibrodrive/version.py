"""Version of the package, in a module of its own: modules that write it to files do not import the package."""

__version__ = "0.1.0"
