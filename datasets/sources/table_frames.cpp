#include "datasets/sources/table_frames.h"

#include <utility>

#include "datasets/sets/csv_cells.h"
#include "datasets/sources/any_source.h"
#include "sim/files/image_file.h"

namespace touchstone::datasets {

namespace fs = std::filesystem;

TableFrames::TableFrames(fs::path place) : place_(std::move(place)) {
  std::error_code failed;
  is_folder_ = fs::is_directory(place_, failed) && !fs::exists(place_ / "dataset.json", failed);
  if (!is_folder_ && is_live(place_.string())) fail("{}: is live; a recording is needed", place_.string());
}

fs::path TableFrames::named(const std::string& cell, const SourceLocation& where) {
  if (is_folder_) return file_in(place_, cell, where);
  if (cell.empty()) fail_at(where, "file: names no frame");
  gone_through_ = false;
  fs::path path = place_ / cell;
  named_.try_emplace(path.string());
  return path;
}

fs::path TableFrames::named_or_file(const fs::path& name) {
  std::error_code failed;
  if (is_folder_) return fs::exists(place_ / name, failed) ? place_ / name : name;
  return fs::exists(name, failed) ? name : named(name.string(), {name.string(), 0});
}

cv::Mat TableFrames::read(const fs::path& frame) {
  if (!named_.contains(frame.string())) return sim::read_image(frame);
  if (!gone_through_) go_through();
  const std::optional<Frame>& found = named_.at(frame.string());
  if (!found) fail("{}: has no frame '{}'", place_.string(), frame.lexically_relative(place_).string());
  if (!found->fault.empty()) fail("{}", found->fault);
  return found->image;
}

void TableFrames::go_through() {
  gone_through_ = true;
  SourceChoice choice;
  choice.place = place_.string();
  for_each_frame(streams_of(choice), [&](const SourceFrame& frame) {
    const auto wanted = named_.find((place_ / name_in_table(frame)).string());
    if (wanted == named_.end() || wanted->second) return;
    wanted->second.emplace(Frame{frame.image.clone(), frame.fault});
  });
}

}  // namespace touchstone::datasets
