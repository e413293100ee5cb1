#include "render/direct/direct_fixture.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/scene/flat_faces.h"

namespace touchstone::render {

DirectFixture::DirectFixture(const LightField& of, bool soft)
    : field(of), bearings(of, soft), groups((of.beam_count() + 3) / 4) {
  const std::vector<FlatFace>& faces = field.fixture.faces;
  low = field.layer > 0 ? faces[field.layer - 1].z : -INFINITY;
  high = field.layer < static_cast<int>(faces.size()) ? faces[field.layer].z : INFINITY;
  const Medium& medium = medium_of_layer(field.fixture, field.layer);
  for (Eigen::Index band = 0; band < medium.absorption.size(); ++band) {
    absorption[band] = static_cast<float>(medium.absorption[band]);
    absorbs = absorbs || medium.absorption[band] > 0.0;
  }
  for (int beam = 0; beam < field.beam_count(); ++beam) {
    const Lamp& lamp = field.lamp(beam);
    lens_frames.emplace_back(lamp_direction(lamp).normalized());
    const int layer = layer_of_height(faces, lamp_position(lamp).z());
    lens_radii.push_back(disc_radius(lamp));
    lamp_index.push_back(medium_of_layer(field.fixture, layer).index);
    lamp_in_layer.push_back(layer == field.layer);
    flattest.push_back(beam);
    while (field.beside[flattest[beam]].flatter >= 0) flattest[beam] = field.beside[flattest[beam]].flatter;
  }
  const std::size_t lamps = field.intensity.size();
  const std::size_t nodes = lamps == 0 ? 0 : field.flow.size() / (4 * lamps);
  const std::size_t width = static_cast<std::size_t>(groups) * 12;
  flow.assign(nodes * width, 0.0f);
  for (std::size_t node = 0; node < nodes; ++node) {
    for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
      for (std::size_t a = 0; a < 3; ++a) {
        flow[node * width + lamp / 4 * 12 + a * 4 + lamp % 4] = field.flow[(node * lamps + lamp) * 4 + a];
      }
    }
  }
  for (int beam = 0; beam < field.beam_count(); ++beam) {
    const auto same = std::find_if(colour_lamp.begin(), colour_lamp.end(),
                                   [&](int other) { return (field.intensity[beam] == field.intensity[other]).all(); });
    colour_of.push_back(static_cast<int>(same - colour_lamp.begin()));
    if (same == colour_lamp.end()) colour_lamp.push_back(beam);
  }
  const auto bands = static_cast<std::size_t>(field.fixture.environment.size());
  intensity.assign(bands * groups * 4, 0.0f);
  if (!field.pass.empty()) pass.assign(nodes * bands * groups * 4, 0.0f);
  for (std::size_t band = 0; band < bands; ++band) {
    for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
      intensity[band * groups * 4 + lamp] = static_cast<float>(field.intensity[lamp][static_cast<Eigen::Index>(band)]);
      for (std::size_t node = 0; !pass.empty() && node < nodes; ++node) {
        pass[(node * bands + band) * groups * 4 + lamp] = field.pass[(node * lamps + lamp) * bands + band];
      }
    }
  }
}

}  // namespace touchstone::render
