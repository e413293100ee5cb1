#include "datasets/sources/drawn_frames.h"

#include <map>
#include <mutex>
#include <opencv2/imgproc.hpp>

#include "core/hdf5_file.h"
#include "datasets/sets/block_file.h"
#include "datasets/sets/manifest.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

// HDF5's library is for one thread at a time, and sequences may be read by several.
std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// A picture as it lies in a block: rows x columns x channels of red, green and blue.
cv::Mat picture_from_block(Hdf5Array<std::uint8_t> array, std::size_t first_axis, const std::string& file) {
  if (array.shape.size() < first_axis + 2 || array.shape.size() > first_axis + 3) {
    fail("{}: has no picture where one belongs", file);
  }
  const auto extent = [&](std::size_t axis) { return static_cast<int>(array.shape[first_axis + axis]); };
  const int channels = array.shape.size() > first_axis + 2 ? extent(2) : 1;
  if (channels != 1 && channels != 3) fail("{}: its frames have {} channels; allowed are 1 and 3", file, channels);
  const cv::Mat stored(extent(0), extent(1), CV_MAKETYPE(CV_8U, channels), array.values.data());
  cv::Mat picture;
  if (channels == 3) {
    cv::cvtColor(stored, picture, cv::COLOR_RGB2BGR);
  } else {
    picture = stored.clone();
  }
  return picture;
}

/// A sample's place.
struct SampleRow {
  std::string block;
  std::int64_t row = 0, sample = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
};

class DrawnFrames : public FrameSource {
 public:
  DrawnFrames(std::shared_ptr<const std::vector<SampleRow>> rows, fs::path folder, std::string prefix)
      : rows_(std::move(rows)), folder_(std::move(folder)), prefix_(std::move(prefix)) {}

  bool next(SourceFrame& frame) override {
    if (next_ == rows_->size()) return false;
    const SampleRow& row = (*rows_)[next_++];
    frame = {};
    frame.label.frame = static_cast<int>(row.sample);
    frame.label.t_us = row.sample;
    frame.label.timed = false;
    frame.label.force = row.force;
    frame.stem = prefix_ + fmt::format("{:06}", row.sample);
    frame.label.file = fmt::format("{:06}", row.sample);
    const std::string file = (folder_ / row.block).string();
    frame.title = fmt::format("{}: sample {}", file, row.sample);
    try {
      const std::lock_guard<std::mutex> lock(hdf5_mutex());
      const Hdf5Reader reader(file);
      frame.image = picture_from_block(reader.read_rows<std::uint8_t>("/frame", row.row, 1), 1, file);
    } catch (const Error& error) {
      frame.fault = fmt::format("{}: {}", frame.title, error.what());
    }
    return true;
  }

 private:
  std::shared_ptr<const std::vector<SampleRow>> rows_;
  fs::path folder_;
  std::string prefix_;
  std::size_t next_ = 0;
};

/// The rows of a block that belong to `split`. @throws Error if it has no frames
void add_rows(const fs::path& folder, const ManifestBlock& block, std::optional<Split> split,
              std::vector<SampleRow>& rows) {
  const std::string file = (folder / block.name).string();
  const auto read = [&] {
    const Hdf5Reader reader(file);
    if (!reader.has("/frame")) fail("{}: has no frames; the job's outputs have none", file);
    reader.walk_rows("/frame");
    const Hdf5Array<int> splits = reader.read<int>("/split");
    const Hdf5Array<double> wrench = reader.read<double>("/wrench");
    const auto samples = static_cast<std::size_t>(block.samples);
    if (splits.values.size() != samples || wrench.values.size() != 6 * samples) {
      fail("{}: doesn't hold {} samples, as dataset.json says", file, block.samples);
    }
    std::vector<SampleRow> found;
    for (std::size_t i = 0; i < samples; ++i) {
      if (split && splits.values[i] != static_cast<int>(*split)) continue;
      const auto row = static_cast<std::int64_t>(i);
      found.push_back({block.name, row, block.first_sample + row,
                       Eigen::Vector3d(wrench.values[6 * i], wrench.values[6 * i + 1], wrench.values[6 * i + 2])});
    }
    return found;
  };
  const std::vector<SampleRow> found = read_hdf5(file, read);
  rows.insert(rows.end(), found.begin(), found.end());
}

}  // namespace

std::vector<FrameStream> drawn_streams(const fs::path& folder, std::optional<Split> split) {
  const Manifest manifest = read_manifest(folder, SetSource::draw);
  const std::lock_guard<std::mutex> lock(hdf5_mutex());
  std::map<int, std::vector<SampleRow>> units;
  for (const ManifestBlock& block : manifest.blocks) {
    std::vector<SampleRow> rows;
    add_rows(folder, block, split, rows);
    std::vector<SampleRow>& unit = units[block.unit];
    unit.insert(unit.end(), rows.begin(), rows.end());
  }
  std::erase_if(units, [](const auto& unit) { return unit.second.empty(); });
  if (units.empty()) fail("{}: has no sample of the split '{}'", folder.string(), split ? name_of(*split) : "any");
  std::vector<FrameStream> streams;
  for (auto& [unit, rows] : units) {
    FrameStream stream;
    stream.name = fmt::format("unit-{}", unit);
    stream.frames = static_cast<std::int64_t>(rows.size());
    const fs::path first = folder / rows.front().block;
    const std::string prefix = units.size() > 1 ? stream.name + "/" : "";
    stream.rest = [first] {
      const std::lock_guard<std::mutex> reading(hdf5_mutex());
      return picture_from_block(Hdf5Reader(first).read<std::uint8_t>("/background"), 0, first.string());
    };
    const auto shared = std::make_shared<const std::vector<SampleRow>>(std::move(rows));
    stream.open = [shared, folder, prefix] { return std::make_unique<DrawnFrames>(shared, folder, prefix); };
    streams.push_back(std::move(stream));
  }
  return streams;
}

}  // namespace touchstone::datasets
