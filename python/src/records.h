#pragma once
// Structured arrays of NumPy: records with fields of names that are known.

#include <string>

#include "core/error.h"
#include "python/src/convert.h"

namespace touchstone::python {

/// A one-dimensional array of records that has these fields. @throws Error that is `wanted`
inline py::array records_from(const py::handle& value, std::initializer_list<const char*> fields,
                              const std::string& wanted) {
  const auto records = py::array::ensure(value);
  if (!records || records.ndim() != 1 || records.dtype().attr("names").is_none()) fail("{}", wanted);
  for (const char* name : fields) {
    if (!records.dtype().attr("names").contains(py::str(name))) fail("{}", wanted);
  }
  return records;
}

/// One field of records, of the kinds of numbers that `kinds` has ("iub": whole ones). @throws Error naming it
template <typename T>
py::array_t<T> field_of(const py::array& records, const char* what, const char* field, const char* kinds = "iub") {
  constexpr int kExact = py::array::c_style | py::array::forcecast;
  const py::array column = py::array::ensure(records[py::str(field)]);
  if (std::string(kinds).find(column.dtype().kind()) == std::string::npos || column.ndim() != 1) {
    fail("{}: the field '{}' must be {}numbers", what, field, std::string(kinds) == "iub" ? "whole " : "");
  }
  return py::array_t<T, kExact>(column);
}

}  // namespace touchstone::python
