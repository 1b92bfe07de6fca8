# LCM (liblcm-dev, liblcm-bin). Debian's lcm.pc asks for a glib that liblcm-dev does not pull in, hence this file.
# Gives LCM::lcm and LCM_GEN_EXECUTABLE.
find_path(LCM_INCLUDE_DIR lcm/lcm.h)
find_library(LCM_LIBRARY lcm)
# Several generations of lcm-gen may be on PATH (pip installs one too): take the one beside the library.
get_filename_component(loc_lcm_prefix "${LCM_INCLUDE_DIR}/.." ABSOLUTE)
find_program(LCM_GEN_EXECUTABLE lcm-gen PATHS "${loc_lcm_prefix}/bin" /usr/bin NO_DEFAULT_PATH)
find_program(LCM_GEN_EXECUTABLE lcm-gen)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LCM REQUIRED_VARS LCM_LIBRARY LCM_INCLUDE_DIR LCM_GEN_EXECUTABLE
  REASON_FAILURE_MESSAGE "Debian: liblcm-dev liblcm-bin")
if(LCM_FOUND AND NOT TARGET LCM::lcm)
  add_library(LCM::lcm UNKNOWN IMPORTED)
  set_target_properties(LCM::lcm PROPERTIES IMPORTED_LOCATION "${LCM_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${LCM_INCLUDE_DIR}")
endif()
mark_as_advanced(LCM_INCLUDE_DIR LCM_LIBRARY LCM_GEN_EXECUTABLE)
