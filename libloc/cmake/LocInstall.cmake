# Install and export: find_package(libloc) in another project gives libloc::loc_core and the other libraries that
# loc_library() made. Headers keep the names by which this tree includes them: "libloc/…", "msgs/…", "loc/…".
option(LOC_INSTALL "Install libraries and headers" ${PROJECT_IS_TOP_LEVEL})
if(NOT LOC_INSTALL)
  return()
endif()
include(CMakePackageConfigHelpers)

get_property(loc_install_targets GLOBAL PROPERTY LOC_INSTALL_TARGETS)
set(loc_include_dir "${CMAKE_INSTALL_INCLUDEDIR}/libloc")
set(loc_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/libloc")

install(TARGETS ${loc_install_targets} EXPORT liblocTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
install(EXPORT liblocTargets NAMESPACE libloc:: DESTINATION "${loc_package_dir}" COMPONENT development)

install(DIRECTORY "${PROJECT_SOURCE_DIR}/libloc" "${PROJECT_SOURCE_DIR}/msgs" DESTINATION "${loc_include_dir}"
  COMPONENT development FILES_MATCHING PATTERN "*.hpp" PATTERN "cmake" EXCLUDE PATTERN "rawlog.hpp" EXCLUDE)
# The generated message types; those of other packages are used inside the library only.
install(DIRECTORY "${PROJECT_BINARY_DIR}/msgs/generated/loc" DESTINATION "${loc_include_dir}" COMPONENT development)
# For programs in other languages, and for the stock LCM tools.
install(DIRECTORY "${PROJECT_SOURCE_DIR}/msgs/" DESTINATION "${CMAKE_INSTALL_DATADIR}/libloc/msgs"
  COMPONENT development FILES_MATCHING PATTERN "*.lcm")

set(loc_installs_vision FALSE)
if(TARGET loc_vision)
  set(loc_installs_vision TRUE)
endif()
set(loc_installs_apriltag FALSE)
if(loc_installs_vision AND TARGET apriltag::apriltag)
  set(loc_installs_apriltag TRUE)
endif()
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/liblocConfig.cmake.in"
  "${PROJECT_BINARY_DIR}/liblocConfig.cmake" INSTALL_DESTINATION "${loc_package_dir}"
  NO_SET_AND_CHECK_MACRO NO_CHECK_REQUIRED_COMPONENTS_MACRO)
# Below 1.0 a minor version may change the interface.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/liblocConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES
  "${PROJECT_BINARY_DIR}/liblocConfig.cmake" "${PROJECT_BINARY_DIR}/liblocConfigVersion.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/FindGeographicLib.cmake" "${CMAKE_CURRENT_LIST_DIR}/FindLCM.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/FindOpenBLAS.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/FindMatio.cmake" "${CMAKE_CURRENT_LIST_DIR}/FindOpenCV.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/FindTurboJPEG.cmake"
  DESTINATION "${loc_package_dir}" COMPONENT development)
