// CSV tables: recorded forces, presses of a ball, displaced markers, spectra. Each text is taken for every kind of
// them.

#include <fstream>

#include "datasets/sources/frame_sequence.h"
#include "lab/chroma/hue_sample_table.h"
#include "lab/gelsight/ball_press_table.h"
#include "render/spectra/spectral_curve.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

namespace touchstone::fuzz {

bool reads(std::string_view bytes) {
  const std::filesystem::path table = scratch_file(bytes, "table.csv");
  const std::filesystem::path folder = table.parent_path();
  static const bool made = std::ofstream(folder / "a.png").good();  // what the seeds' rows name
  TS_ASSERT(made);
  bool read = gives_result([&] { datasets::frames_of_force_table(folder, table); });
  read |= gives_result([&] { lab::read_ball_press_table(folder, table); });
  read |= gives_result([&] { lab::read_hue_sample_table(folder, table, {7, 5}); });
  for (const auto kind : {render::CurveKind::share, render::CurveKind::relative, render::CurveKind::per_mm}) {
    read |= gives_result([&] {
      const render::SpectralCurve curve = render::read_spectral_curve(table, kind);
      TS_ASSERT(curve.mean(400.0, 700.0) >= 0.0);
    });
  }
  return read;
}

}  // namespace touchstone::fuzz
