#include "lab/gelsight/texture_table.h"

#include <algorithm>

#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "lab/gelsight/label_table.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

/// The model without samples that `use` refuses.
template <typename Use>
sensors::TextureModel part_of(const sensors::TextureModel& model, const Use& use) {
  sensors::TextureModel part = model;
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < model.features.rows(); ++i) {
    if (!use(i)) continue;
    part.features.row(kept) = model.features.row(i);
    part.labels[static_cast<std::size_t>(kept++)] = model.labels[static_cast<std::size_t>(i)];
  }
  part.features.conservativeResize(kept, Eigen::NoChange);
  part.labels.resize(static_cast<std::size_t>(kept));
  return part;
}

/// Judges each map by the samples of all others. @param map_of the map that each sample is from
void judge_left_out(const std::vector<int>& map_of, TextureCalibration& made) {
  const sensors::TextureModel& model = made.model;
  for (int map = 0; map < made.maps; ++map) {
    const auto at = [](Eigen::Index i) { return static_cast<std::size_t>(i); };
    const sensors::TextureModel others = part_of(model, [&](Eigen::Index i) { return map_of[at(i)] != map; });
    int label = -1;
    std::vector<sensors::TextureMatch> matches;
    for (Eigen::Index i = 0; i < model.features.rows(); ++i) {
      if (map_of[at(i)] != map) continue;
      label = model.labels[at(i)];
      if (others.labels.empty()) break;
      matches.push_back(sensors::classify(others, model.features.row(i).transpose()));
    }
    if (std::ranges::find(others.labels, label) == others.labels.end()) continue;
    ++made.left_out;
    const sensors::TextureVote vote = sensors::vote(matches);
    if (vote.label != label) continue;
    ++made.right;
    made.farthest_right = std::max(made.farthest_right, vote.distance);
  }
}

}  // namespace

TextureCalibration learn_textures(HeightSource& source, const fs::path& place, const fs::path& labels,
                                  const TextureLearning& how, const Progress& progress) {
  datasets::TableFrames frames(place);
  const std::vector<LabelledMap> table = read_label_table(frames, labels);
  TextureCalibration made;
  made.model.op = how.op;
  made.model.gray_step_mm = how.gray_step_mm;
  made.model.mm_per_px = source.mm_per_px();
  std::vector<int> map_of;
  std::int64_t done = 0;
  for (const LabelledMap& one : table) {
    std::string fault = datasets::fault_in([&] {
      const cv::Mat heights = source.read(frames, one.file);
      datasets::naming(one.file, [&] {
        for (const cv::Mat& square : sensors::squares_of(heights, how.square_px)) {
          sensors::learn_texture(made.model, one.material, square);
          map_of.push_back(made.maps);
        }
      });
      ++made.maps;
    });
    if (!fault.empty()) made.faults.push_back(std::move(fault));
    if (progress) progress("textures", ++done, std::ssize(table));
  }
  datasets::require_a_frame(made.faults, table.size());
  judge_left_out(map_of, made);
  return made;
}

std::vector<TextureRecord> write_materials(const sensors::TextureModel& model, HeightSource& source, int square_px,
                                           const fs::path& csv, const Progress& progress) {
  std::vector<TextureRecord> records;
  std::vector<std::string> faults;
  std::string table = "file,material,squares,agreeing,distance,fault\n";
  const std::int64_t total = source.maps();
  for (SourceHeights map; source.next(map);) {
    TextureRecord record;
    record.file = map.file;
    record.fault = map.fault.empty() ? datasets::fault_in([&] {
      datasets::naming(map.title, [&] {
        std::vector<sensors::TextureMatch> matches;
        for (const cv::Mat& square : sensors::squares_of(map.height_mm, square_px)) {
          matches.push_back(sensors::classify_texture(model, square, source.mm_per_px()));
        }
        record.vote = sensors::vote(matches);
        record.material = model.classes[static_cast<std::size_t>(record.vote.label)];
      });
    })
                                     : map.fault;
    if (record.fault.empty()) {
      table +=
          fmt::format("{},{},{},{},{:.4f},\n", datasets::csv_cell(record.file), datasets::csv_cell(record.material),
                      record.vote.squares, record.vote.agreeing, record.vote.distance);
    } else {
      table += fmt::format("{},,,,,{}\n", datasets::csv_cell(record.file), datasets::csv_cell(record.fault));
      faults.push_back(record.fault);
    }
    records.push_back(std::move(record));
    if (progress) progress("textures", std::ssize(records), total);
  }
  datasets::require_a_frame(faults, records.size());
  write_whole_file(csv, table);
  return records;
}

}  // namespace touchstone::lab
