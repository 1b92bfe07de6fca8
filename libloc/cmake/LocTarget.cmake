# Settings of every target of ours, given per target so that a project which adds libloc as a
# subfolder keeps its own flags.

set(loc_sanitize_flags "")
if(LOC_SANITIZE)
  set(loc_sanitize_flags -fsanitize=${LOC_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  if(LOC_SANITIZE MATCHES "address" AND LOC_SANITIZE MATCHES "undefined")
    # What the address sanitizer sees anyway; a quarter of the time that it takes to compile. No file may be left out as a whole:
    # memory that one file allocates and another frees must be of one kind, and Eigen's is not.
    list(APPEND loc_sanitize_flags -fno-sanitize=null,object-size,alignment,vptr)
  endif()
endif()

# The thread sanitizer need not see code that has no threads and shares nothing: what these libraries' own files do to
# memory goes unwatched then, what their callers do does not. Not for the address sanitizer: see above.
set(LOC_NOT_SANITIZED "" CACHE STRING "Libraries that are built without LOC_SANITIZE=thread, as any other build has them: loc_core;loc_io")
if(LOC_NOT_SANITIZED AND NOT LOC_SANITIZE STREQUAL "thread")
  message(FATAL_ERROR "LOC_NOT_SANITIZED=${LOC_NOT_SANITIZED}: only with LOC_SANITIZE=thread, not '${LOC_SANITIZE}'")
endif()
if(LOC_SANITIZE STREQUAL "thread")
  # In a release build, so that those libraries are compiled like the release's, and come out of ccache.
  list(APPEND loc_sanitize_flags $<$<CONFIG:Release>:-O1> $<$<CONFIG:Release>:-g1> $<$<CONFIG:Release>:-UNDEBUG>)
endif()

if(LOC_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "LOC_FUZZ needs clang with libFuzzer: -DCMAKE_CXX_COMPILER=clang++-14 (Debian: clang-14 libclang-rt-14-dev)")
  endif()
  list(APPEND loc_sanitize_flags -fsanitize=fuzzer-no-link,address -fno-omit-frame-pointer -g1)
endif()

# One setting for the whole program: objects built for different vector widths that exchange Eigen
# types disagree on alignment. PUBLIC, so that a user's own files agree too.
set(loc_arch_flags "")
if(LOC_NATIVE)
  set(loc_arch_flags -march=native)
endif()

function(loc_target_options target)
  set(sanitize_flags ${loc_sanitize_flags})
  if(target IN_LIST LOC_NOT_SANITIZED)
    set(sanitize_flags "")
  endif()
  set_target_properties(${target} PROPERTIES CXX_STANDARD 20 CXX_STANDARD_REQUIRED ON CXX_EXTENSIONS OFF
                        POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                         -Wnon-virtual-dtor -Woverloaded-virtual $<$<BOOL:${LOC_WARNINGS_AS_ERRORS}>:-Werror>
                         ${sanitize_flags})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-restrict)  # false alarms on std::string: GCC bug 105651
  endif()
  target_link_options(${target} PRIVATE ${sanitize_flags})
  get_target_property(type ${target} TYPE)
  if(NOT type STREQUAL "INTERFACE_LIBRARY")
    target_compile_options(${target} PUBLIC ${loc_arch_flags})
    target_compile_features(${target} PUBLIC cxx_std_20)
  endif()
endfunction()

# Includes are written "libloc/…", "msgs/…", "loc/…" (generated), in this tree and when installed.
function(loc_library target)
  add_library(${target} STATIC ${ARGN})
  add_library(libloc::${target} ALIAS ${target})
  loc_target_options(${target})
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/libloc>)
  set_property(GLOBAL APPEND PROPERTY LOC_INSTALL_TARGETS ${target})
endfunction()
