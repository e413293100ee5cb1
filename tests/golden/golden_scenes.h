#pragma once
// The scenes whose pictures are kept under tests/golden/images. Small (64 x 48 pixels, or 32 x 24 with 16 bands), each
// of other parts of the renderer, each what a real sensor might look like.

#include <string>
#include <vector>

#include "render/cameras/camera.h"
#include "render/scene/scene.h"

namespace touchstone::golden {

struct GoldenScene {
  std::string name;
  render::Scene scene;
  render::Camera camera;
};

/// The file names of the pictures, without ending.
const std::vector<std::string>& golden_names();

/// @throws Error for a name that isn't among them
GoldenScene golden_scene(const std::string& name);

/// The printed membrane with its white of another albedo and its red lamp moved along its row: for the test of the
/// test.
GoldenScene printed_membrane(double albedo, double lamp_shift_mm);

}  // namespace touchstone::golden
