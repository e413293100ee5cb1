#pragma once

#include "sim/sensor/light_file.h"

namespace touchstone::test {

/// The light of two beams in a grid of eight nodes, in so many bands.
inline sim::FoundLight small_light(int bands = 3) {
  sim::FoundLight light;
  light.choice.direct = true;
  light.choice.reason = "as it's wanted";
  render::LightField& field = light.field;
  field.reach = Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 1));
  field.nodes.setConstant(2);
  field.step.setConstant(1.0);
  field.lamp_of = {0, 0};
  field.intensity.assign(2, render::Spectrum::Constant(bands, 0.5));
  field.beside.resize(2);
  field.beside[0].steeper = 1;
  field.beside[1].flatter = 0;
  field.flow.assign(2 * 4 * 8, 0.25F);
  return light;
}

}  // namespace touchstone::test
