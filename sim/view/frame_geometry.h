#pragma once

#include <vector>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "sim/files/gltf_writer.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// One frame's surfaces and cameras, as write_glb takes them.
struct FrameGeometry {
  std::vector<GltfPart> parts;  ///< `gel surface`, `gel in contact`, `bead` (at each bead), the objects by their names
  std::vector<GltfCamera> cameras;  ///< the device's, if it has one
};

/// A frame's geometry for viewers: the gel's outer surface as a camera sees it (VisibleGel; without fine relief), any
/// shape of gel; beads, objects and screens where they stand. Gel frame, mm.
FrameGeometry frame_geometry(const SceneSpec& scene, const fem::Compliance& gel, const fem::PressState& press);

}  // namespace touchstone::sim
