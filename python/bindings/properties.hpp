// Properties of classes that are small Eigen types in C++ and arrays in Python.
#pragma once

#include "arrays.hpp"

namespace locpy {

/// A property that is a vector (3,): Python gets a copy, because a view would let it write past the checks.
template <class Class, class T>
void vector_property(Class& c, const char* name, Eigen::Vector3d T::*member, const char* doc) {
  c.def_property(
      name, [member](const T& self) { return to_array(self.*member); },
      [member, name](T& self, const ArrayLike& value) { self.*member = vector3(value, name); }, doc);
}

template <class Class, class T>
void matrix_property(Class& c, const char* name, Eigen::Matrix3d T::*member, const char* doc) {
  c.def_property(
      name, [member](const T& self) { return to_matrix_array(self.*member); },
      [member, name](T& self, const ArrayLike& value) { self.*member = matrix(value, name, 3, 3); }, doc);
}

}  // namespace locpy
