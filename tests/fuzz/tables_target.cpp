// CSV tables: recorded forces, presses of a ball, displaced markers, spectra, labels, marks on a gel, grasps, a chip's
// registers, presses of a fingertip, patches of colour, regions. Each text is taken for every kind of them.

#include <fstream>

#include "datasets/sources/force_readings_table.h"
#include "datasets/sources/frame_sequence.h"
#include "lab/chroma/hue_sample_table.h"
#include "lab/dvs/grasp_files.h"
#include "lab/gelsight/ball_press_table.h"
#include "lab/gelsight/label_table.h"
#include "lab/gelsight/mark_table.h"
#include "lab/reflex/press_table.h"
#include "lab/reflex/register_table.h"
#include "lab/vhs/region_table.h"
#include "lab/vhs/softness_table.h"
#include "render/spectra/spectral_curve.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

namespace touchstone::fuzz {

bool reads(std::string_view bytes) {
  const std::filesystem::path table = scratch_file(bytes, "table.csv");
  const std::filesystem::path folder = table.parent_path();
  // What the seeds' rows name.
  static const bool made = std::ofstream(folder / "a.png").good() &&
                           (std::ofstream(folder / "f.csv") << "t_us,force_N\n0,0\n4000,0.5\n8000,1\n").good();
  TS_ASSERT(made);
  datasets::TableFrames frames(folder);
  bool read = gives_result([&] { datasets::frames_of_force_table(folder, table); });
  read |= gives_result([&] { lab::read_ball_press_table(frames, table); });
  read |= gives_result([&] { lab::read_hue_sample_table(frames, table, {7, 5}); });
  read |= gives_result([&] { lab::read_label_table(frames, table); });
  read |= gives_result([&] { lab::read_place_map(table, {320, 240}); });
  read |= gives_result([&] { lab::read_grasp_table(table, lab::GraspNeeds::forces); });
  read |= gives_result([&] { lab::read_grasp_table(table, lab::GraspNeeds::materials); });
  read |= gives_result([&] { datasets::read_force_readings(table); });
  read |= gives_result([&] { lab::read_softness_table(table, 0.0); });
  read |= gives_result([&] { lab::read_register_table(table); });
  // What a loop makes of registers that nobody has checked, and what a model learns of them.
  read |= gives_result([&] {
    const lab::KnownRegisters known = lab::read_known_registers({table}, 0.02);
    sensors::train_reflex(known.recordings, {.tree = {.folds = 2}});
  });
  read |= gives_result([&] { lab::read_press_table(table); });
  read |= gives_result([&] { lab::read_patch_table(frames, table); });
  read |= gives_result([&] { lab::read_region_table(table, {160, 120}); });
  for (const auto kind : {render::CurveKind::share, render::CurveKind::relative, render::CurveKind::per_mm}) {
    read |= gives_result([&] {
      const render::SpectralCurve curve = render::read_spectral_curve(table, kind);
      TS_ASSERT(curve.mean(400.0, 700.0) >= 0.0);
    });
  }
  return read;
}

}  // namespace touchstone::fuzz
