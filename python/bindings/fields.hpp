// Plain structs of options as Python classes whose fields are keywords of the constructor: Options(clones=1).
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <string>

namespace locpy {

/// @param type name for messages. @throws py::type_error naming a field that it does not have.
template <class T>
void set_fields(const char* type, T& value, const pybind11::kwargs& fields) {
  const pybind11::object self = pybind11::cast(&value, pybind11::return_value_policy::reference);
  for (const auto& [name, field] : fields) {
    if (!pybind11::hasattr(self, name)) {
      throw pybind11::type_error(std::string(type) + " has no field " + pybind11::cast<std::string>(name));
    }
    pybind11::setattr(self, name, field);
  }
}

/// @throws as set_fields; what check() throws.
template <class T>
std::unique_ptr<T> with_fields(const char* type, const pybind11::kwargs& fields) {
  auto value = std::make_unique<T>();
  set_fields(type, *value, fields);
  value->check();
  return value;
}

}  // namespace locpy
