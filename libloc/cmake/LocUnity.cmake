# Unity builds (LOC_UNITY): files that go to the compiler together, so that what they include is parsed, and what they share
# of Eigen's templates compiled, once. The groups are written down, because files with a name in common cannot go together;
# a file that is in no group is compiled alone.
#   loc_unity(target GROUP file… [GROUP file…]…)
function(loc_unity target)
  set(group 0)
  foreach(item IN LISTS ARGN)
    if(item STREQUAL "GROUP")
      math(EXPR group "${group} + 1")
    else()
      set_property(SOURCE ${item} PROPERTY UNITY_GROUP ${target}_${group})
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  target_compile_options(${target} PRIVATE -Wno-subobject-linkage)  # which takes an included file for a header
endfunction()
