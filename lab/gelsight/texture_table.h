#pragma once
// Materials by touch, from height maps on disk.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/gelsight/height_source.h"
#include "sensors/texture/texture_squares.h"

namespace touchstone::lab {

/// How maps become samples.
struct TextureLearning {
  sensors::TextureOperator op = {};
  double gray_step_mm = sensors::TextureModel{}.gray_step_mm;
  int square_px = 200;  ///< a side of a sample; [Li2015, sec. 5.3.2]
};

/// A model, and what it does with maps that it hasn't learnt from.
struct TextureCalibration {
  sensors::TextureModel model;
  int maps = 0;                          ///< learnt from
  int left_out = 0;                      ///< of them, judged by all others: those whose material has another map
  int right = 0;                         ///< of these, told right
  double farthest_right = 0.0;           ///< largest TextureVote::distance of these
  std::vector<std::string> faults = {};  ///< of files that are left out, naming them
};

/// Learns from the files that `labels` names: a CSV with the header `file,material`, files of `place`, a folder or, of
/// frames, another recording.
/// @throws Error with file and line for a table that can't be used; if no file can be; for squares smaller than the
/// operator needs
TextureCalibration learn_textures(HeightSource& source, const std::filesystem::path& place,
                                  const std::filesystem::path& labels, const TextureLearning& how,
                                  const Progress& progress = {});

/// One file's material, or why there's none.
struct TextureRecord {
  std::string file, material;
  sensors::TextureVote vote;
  std::string fault = {};
};

/// Names the material of each of the source's maps and writes `csv`: `file,material,squares,agreeing,distance,fault`.
/// @throws Error if no file can be used, or for a source whose pixels have another size than the model's
std::vector<TextureRecord> write_materials(const sensors::TextureModel& model, HeightSource& source, int square_px,
                                           const std::filesystem::path& csv, const Progress& progress = {});

}  // namespace touchstone::lab
