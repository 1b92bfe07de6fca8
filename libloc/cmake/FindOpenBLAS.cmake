# OpenBLAS (libopenblas-serial-dev): picks its kernels by the processor at run time. Any library with BLAS's and LAPACK's
# Fortran interface will do: -DOpenBLAS_LIBRARY=PATH. Gives OpenBLAS::OpenBLAS.
find_library(OpenBLAS_LIBRARY openblas PATH_SUFFIXES openblas-serial openblas-pthread openblas-openmp)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenBLAS REQUIRED_VARS OpenBLAS_LIBRARY
  REASON_FAILURE_MESSAGE "Debian: libopenblas-serial-dev")
if(OpenBLAS_FOUND AND NOT TARGET OpenBLAS::OpenBLAS)
  add_library(OpenBLAS::OpenBLAS UNKNOWN IMPORTED)
  set_target_properties(OpenBLAS::OpenBLAS PROPERTIES IMPORTED_LOCATION "${OpenBLAS_LIBRARY}")
endif()
mark_as_advanced(OpenBLAS_LIBRARY)
