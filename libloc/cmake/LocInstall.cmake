# Install and export: find_package(libloc) in another project gives libloc::loc_core and the other libraries.
