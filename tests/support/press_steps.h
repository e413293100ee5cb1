#pragma once
// Steps of a press, as tests of fem ask for them.

#include <string>

#include "core/error.h"
#include "fem/contact/press.h"

namespace touchstone::test {

/// The object's origin led to a place, gel frame, mm.
inline fem::PressTarget target_at(double x, double y, double z) {
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(x), fem::AxisControl::at(y), fem::AxisControl::at(z)};
  return target;
}

/// Why a step is refused; empty where it's taken.
inline std::string press_refusal(fem::Press& press, const fem::PressTarget& target) {
  try {
    press.step(target);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace touchstone::test
