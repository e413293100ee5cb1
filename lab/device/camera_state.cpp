#include "lab/device/camera_state.h"

#include <nlohmann/json.hpp>

namespace touchstone::lab {
namespace {

nlohmann::json numbers(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

std::string to_json(const CameraState& state, const std::string& more) {
  nlohmann::ordered_json json = {{"what", state.what},
                                 {"scene_frame", state.frame},
                                 {"t_us", state.t_us},
                                 {"force_N", numbers(state.force_N)},
                                 {"force_error_N", numbers(state.force_error_N)},
                                 {"torque_Nmm", numbers(state.torque_Nmm)},
                                 {"gel_from_object", nullptr},
                                 {"contact_area_mm2", state.contact_area_mm2}};
  if (state.gel_from_object) {
    nlohmann::json rows = nlohmann::json::array();
    for (int row = 0; row < 3; ++row) {
      const Eigen::RowVector3d turn = state.gel_from_object->rotation.row(row);
      rows.push_back({turn.x(), turn.y(), turn.z(), state.gel_from_object->translation[row]});
    }
    json["gel_from_object"] = rows;
  }
  const std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return "{" + more + text.substr(1);
}

}  // namespace touchstone::lab
