#pragma once
// A shear law in a model file. For the .cpp files of models only, as json_field.h.

#include "sensors/models/sealed_json.h"
#include "sensors/reflex/shear_law.h"

namespace touchstone::sensors {

/// `per` says what the displacement is: "count" or "mm".
inline Json json_of(const ShearLaw& law, const std::string& per) {
  return {{"N_per_" + per, json_of(Eigen::MatrixXd(law.stiffness))},
          {"per_" + per, json_of(Eigen::MatrixXd(law.per_N))},
          {"rms_residual_N", law.rms_residual_N}};
}

/// The law that json_of wrote with the same `per`. @throws Error naming the field that isn't as it should be
inline ShearLaw shear_law_of(const JsonField& json, const std::string& per) {
  const std::string stiffness = "N_per_" + per, grows = "per_" + per;
  json.expect_map({stiffness, grows, "rms_residual_N"});
  ShearLaw law;
  for (int row = 0; row < 2; ++row) {
    json.at(stiffness.c_str()).expect_list(2);
    json.at(grows.c_str()).expect_list(2);
    law.stiffness.row(row) = json.at(stiffness.c_str()).at(static_cast<std::size_t>(row)).vector<2>().transpose();
    law.per_N.row(row) = json.at(grows.c_str()).at(static_cast<std::size_t>(row)).vector<2>().transpose();
  }
  law.rms_residual_N = json.at("rms_residual_N").number();
  if (law.rms_residual_N < 0.0) json.at("rms_residual_N").refuse("is {}, at least 0 is needed", law.rms_residual_N);
  return law;
}

/// What is wrong with it; empty if nothing is.
inline std::string fault_of(const ShearLaw& law) {
  if (!law.stiffness.allFinite() || !law.per_N.allFinite()) return "the shear law has figures that aren't finite";
  if (!(law.rms_residual_N >= 0.0) || !std::isfinite(law.rms_residual_N)) {
    return fmt::format("the shear law's residual is {} N, at least 0 is needed", law.rms_residual_N);
  }
  return {};
}

}  // namespace touchstone::sensors
