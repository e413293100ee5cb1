#pragma once
// What a study will simulate, for `touchstone plan`.

#include <string>
#include <vector>

#include "lab/studies/study.h"
#include "sim/scene/scene.h"

namespace touchstone::lab {

/// One kind of simulation that a study makes of each of its designs.
struct StudyScene {
  std::string what;      ///< "presses with up to 5 N, pictured"
  sim::SceneSpec scene;  ///< of the device as its file has it
};

/// In the study's order; none where a study is by formula alone.
std::vector<StudyScene> study_scenes(const StudySpec& study);

/// How many designs a study tries.
std::size_t design_count(const StudySpec& study);

}  // namespace touchstone::lab
