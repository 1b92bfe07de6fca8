"""Programs of the package: one file each."""
