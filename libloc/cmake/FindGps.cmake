# libgps (libgps-dev): the client library of gpsd. Gives Gps::gps.
find_path(Gps_INCLUDE_DIR gps.h)
find_library(Gps_LIBRARY gps)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Gps REQUIRED_VARS Gps_LIBRARY Gps_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "Debian: libgps-dev")
if(Gps_FOUND AND NOT TARGET Gps::gps)
  add_library(Gps::gps UNKNOWN IMPORTED)
  set_target_properties(Gps::gps PROPERTIES IMPORTED_LOCATION "${Gps_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${Gps_INCLUDE_DIR}")
endif()
mark_as_advanced(Gps_INCLUDE_DIR Gps_LIBRARY)
