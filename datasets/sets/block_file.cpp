#include "datasets/sets/block_file.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/hdf5_file.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "datasets/sets/run_identity.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kFormat = "touchstone-block";
constexpr int kFormatVersion = 1;
constexpr std::size_t kUserBlock = 512;
constexpr float kHeightStep_mm = 1.0f / 8192.0f;  // heights are rounded to it, so that they pack well: 0.12 um

std::string head_of(const std::string& identity, const DrawnBlock& block, const std::string& sha256) {
  return ordered_json{{"format", kFormat},     {"version", kFormatVersion},          {"run", identity},
                      {"block", block.number}, {"first_sample", block.first_sample}, {"samples", block.samples},
                      {"sha256", sha256}}
             .dump() +
         "\n";
}

/// A picture's pixels as they are kept: colours in the order red, green, blue.
std::vector<std::uint8_t> bytes_of(const cv::Mat& picture) {
  const int channels = picture.channels();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(picture.total() * static_cast<std::size_t>(channels));
  for (int row = 0; row < picture.rows; ++row) {
    const auto* from = picture.ptr<std::uint8_t>(row);
    for (int column = 0; column < picture.cols; ++column, from += channels) {
      for (int c = channels; c-- > 0;) bytes.push_back(from[c]);
    }
  }
  return bytes;
}

std::vector<float> rounded_heights(const cv::Mat& height) {
  std::vector<float> values;
  values.reserve(height.total());
  for (int row = 0; row < height.rows; ++row) {
    const auto* from = height.ptr<float>(row);
    for (int column = 0; column < height.cols; ++column) {
      const float value = from[column];
      values.push_back(std::isfinite(value) ? std::nearbyint(value / kHeightStep_mm) * kHeightStep_mm : value);
    }
  }
  return values;
}

/// Writes columns, all of as many rows.
class Columns {
 public:
  Columns(Hdf5Writer& file, std::span<const BlockRecord> records) : file_(file), records_(records) {}

  template <typename T>
  void one(const std::string& name, const std::string& unit, const std::string& meaning,
           const std::function<T(const BlockRecord&)>& value, const std::string& frame = "") {
    std::vector<T> values;
    for (const BlockRecord& record : records_) values.push_back(value(record));
    file_.write<T>({"/" + name, unit, "samples", frame, meaning}, rows(), {}, values);
  }
  /// Of `shape` numbers, which `put` appends.
  void many(const std::string& name, const std::string& unit, const std::string& axes,
            const std::vector<std::int64_t>& shape, const std::string& meaning,
            const std::function<void(const BlockRecord&, std::vector<double>&)>& put) {
    std::vector<double> values;
    for (const BlockRecord& record : records_) put(record, values);
    file_.write<double>({"/" + name, unit, "samples x " + axes, "gel", meaning}, rows(), shape, values);
  }
  template <typename T>
  void pictures(const std::string& name, const std::string& unit, const std::string& axes,
                const std::vector<std::int64_t>& shape, const std::string& meaning,
                const std::function<std::vector<T>(const BlockRecord&)>& pixels) {
    file_.add_packed_rows<T>({"/" + name, unit, "samples x " + axes, "", meaning}, rows(), shape);
    std::size_t size = 1;
    for (const std::int64_t extent : shape) size *= static_cast<std::size_t>(extent);
    std::vector<std::vector<std::uint8_t>> packed(records_.size());
    tbb::parallel_for(std::size_t{0}, records_.size(), [&](std::size_t i) {
      const std::vector<T> values = pixels(records_[i]);
      TS_ASSERT(values.size() == size);
      packed[i] = pack_hdf5_row(values.data(), values.size() * sizeof(T), sizeof(T));
    });
    for (std::size_t i = 0; i < packed.size(); ++i) {
      file_.write_packed_row("/" + name, static_cast<std::int64_t>(i), packed[i]);
    }
  }

 private:
  std::int64_t rows() const { return static_cast<std::int64_t>(records_.size()); }

  Hdf5Writer& file_;
  std::span<const BlockRecord> records_;
};

void write_pictures(Columns& columns, const DrawnOutputs& wanted, const cv::Mat& background) {
  const std::int64_t height = background.rows;
  const std::int64_t width = background.cols;
  const std::int64_t channels = background.channels();
  if (wanted.frame) {
    columns.pictures<std::uint8_t>("frame", "DN", channels == 3 ? "row x column x rgb" : "row x column x grey",
                                   {height, width, channels}, "what the camera delivers, with its noise",
                                   [](const BlockRecord& r) { return bytes_of(r.frame); });
  }
  if (wanted.height) {
    columns.pictures<float>("height", "mm", "row x column", {height, width},
                            "how far the membrane that the pixel sees is pressed in, against what it sees at rest, "
                            "along z; NaN where it sees none; rounded to 2^-13 mm",
                            [](const BlockRecord& r) { return rounded_heights(r.height); });
  }
  if (wanted.contact) {
    columns.pictures<std::uint8_t>("contact", "1", "row x column", {height, width},
                                   "1 where the pixel sees membrane that lies on the object", [](const BlockRecord& r) {
                                     std::vector<std::uint8_t> mask = bytes_of(r.contact);
                                     for (std::uint8_t& one : mask) one = one != 0 ? 1 : 0;
                                     return mask;
                                   });
  }
}

void put_rows(const Eigen::MatrixX3d& rows, std::vector<double>& to) {
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    for (int axis = 0; axis < 3; ++axis) to.push_back(rows(row, axis));
  }
}

void write_places(Hdf5Writer& file, const std::string& name, const std::string& of, const std::string& meaning,
                  const Eigen::MatrixX3d& places) {
  std::vector<double> values;
  put_rows(places, values);
  file.write<double>({"/" + name, "mm", of + " x 3", "gel", meaning}, places.rows(), {3}, values);
}

/// What moves with the gel, and where it is at rest.
void write_fields(Hdf5Writer& file, Columns& columns, const DrawnOutputs& wanted, const UnitSensor& sensor) {
  const auto field = [&](const std::string& name, const std::string& unit, const std::string& of,
                         const std::string& meaning, Eigen::Index rows, Eigen::MatrixX3d BlockRecord::*member) {
    columns.many(name, unit, of + " x 3", {rows, 3}, meaning, [rows, member](const BlockRecord& r, auto& to) {
      TS_ASSERT((r.*member).rows() == rows);
      put_rows(r.*member, to);
    });
  };
  if (wanted.beads) {
    write_places(file, "bead_places", "beads", "of the beads' centres at rest", sensor.bead_places_mm);
    field("bead_displacement", "mm", "beads", "of the beads", sensor.bead_places_mm.rows(), &BlockRecord::beads_mm);
  }
  if (wanted.markers) {
    write_places(file, "marker_places", "markers", "of the printed markers' middles, or the pins' tips, at rest",
                 sensor.marker_places_mm);
    field("marker_displacement", "mm", "markers", "of the gel under each printed marker's middle, or of each pin's tip",
          sensor.marker_places_mm.rows(), &BlockRecord::markers_mm);
  }
  if (wanted.traction) {
    write_places(file, "gel_vertices", "vertices", "of the gel's surface at rest", sensor.gel_vertices_mm);
    field("traction", "MPa", "vertices", "on the gel", sensor.gel_vertices_mm.rows(), &BlockRecord::traction_MPa);
  }
}

/// Of all samples one after the other; events/count says how many are whose.
void write_events(Hdf5Writer& file, Columns& columns, std::span<const BlockRecord> records) {
  columns.one<std::int64_t>("events/count", "1", "of this sample's events; those of all samples stand in their order",
                            [](const BlockRecord& r) { return static_cast<std::int64_t>(r.events.size()); });
  std::vector<std::int64_t> t;
  std::vector<std::uint16_t> x, y;
  std::vector<std::uint8_t> on;
  for (const BlockRecord& record : records) {
    for (const Event& event : record.events) {
      t.push_back(event.t_us);
      x.push_back(event.x);
      y.push_back(event.y);
      on.push_back(event.on ? 1 : 0);
    }
  }
  const auto count = static_cast<std::int64_t>(t.size());
  file.write<std::int64_t>({"/events/t_us", "us", "events", "", "since the press's start"}, count, {}, t);
  file.write<std::uint16_t>({"/events/x", "px", "events", "", "column"}, count, {}, x);
  file.write<std::uint16_t>({"/events/y", "px", "events", "", "row"}, count, {}, y);
  file.write<std::uint8_t>({"/events/on", "1", "events", "", "1 where the light grew"}, count, {}, on);
}

void write_statistics(Columns& columns) {
  columns.many(
      "statistics", "1", "6", {6},
      "of the motion chip's last frame: dx, dy (counts, summed over the press), maximum, minimum, squal, average",
      [](const BlockRecord& r, std::vector<double>& to) {
        const ChipStatistics& s = r.statistics;
        for (const int one : {s.dx, s.dy, s.maximum, s.minimum, s.squal}) to.push_back(one);
        to.push_back(s.average);
      });
}

void write_labels(Columns& columns) {
  using R = BlockRecord;
  columns.one<std::int64_t>("sample", "1", "number in the data set", [](const R& r) { return r.touch.sample; });
  columns.one<std::uint64_t>("seed", "1", "of the imager's noise in this frame",
                             [](const R& r) { return r.touch.seed; });
  columns.one<std::int32_t>("attempt", "1", "how many draws before this one couldn't be pressed",
                            [](const R& r) { return r.touch.attempt; });
  columns.one<std::int32_t>("unit", "1", "which sensor of the design", [](const R& r) { return r.touch.unit; });
  columns.one<std::int32_t>("object", "1", "number in the job's list of objects",
                            [](const R& r) { return r.touch.object; });
  columns.one<std::int64_t>("piece", "1", "which piece of that object", [](const R& r) { return r.touch.piece; });
  columns.one<std::uint8_t>("split", "1", "0 train, 1 validate, 2 test",
                            [](const R& r) { return static_cast<std::uint8_t>(r.touch.split); });
  columns.many("wrench", "N, N mm", "6", {6}, "on the object: force, torque about the gel frame's origin",
               [](const R& r, std::vector<double>& to) { to.insert(to.end(), r.wrench.begin(), r.wrench.end()); });
  columns.many(
      "wrench_error", "N", "3", {3},
      "one standard error of each force component, from the mesh (of the pose, where force was asked for)",
      [](const R& r, std::vector<double>& to) { to.insert(to.end(), r.force_error_N.begin(), r.force_error_N.end()); });
  columns.many("pose", "1, mm", "3 x 4", {3, 4}, "gel_from_object: rotation, then position of the object's origin",
               [](const R& r, std::vector<double>& to) {
                 for (int row = 0; row < 3; ++row) {
                   for (int column = 0; column < 4; ++column) to.push_back(r.pose(row, column));
                 }
               });
  const auto number = [&](const std::string& name, const std::string& unit, const std::string& meaning,
                          const std::function<double(const R&)>& value) {
    columns.one<double>(name, unit, meaning, value);
  };
  number("deepest_mm", "mm", "how far the gel's surface is pressed in", [](const R& r) { return r.deepest_mm; });
  number("contact_area_mm2", "mm^2", "of the mechanics' vertices in contact",
         [](const R& r) { return r.contact_area_mm2; });
  number("largest_strain", "1", "linear elasticity's own measure: above some 0.2 don't trust percents",
         [](const R& r) { return r.largest_strain; });
  columns.one<std::uint8_t>("under_resolved", "1", "1 where too few nodes touch for a force exact to a percent",
                            [](const R& r) { return std::uint8_t(r.under_resolved ? 1 : 0); });
  number("drawn/place_x_mm", "mm", "of the object's origin before the drag",
         [](const R& r) { return r.touch.place_mm.x(); });
  number("drawn/place_y_mm", "mm", "likewise", [](const R& r) { return r.touch.place_mm.y(); });
  number("drawn/turn_deg", "deg", "about z, before the tilt", [](const R& r) { return r.touch.turn_deg; });
  number("drawn/tilt_deg", "deg", "about a level axis", [](const R& r) { return r.touch.tilt_deg; });
  number("drawn/tilt_axis_deg", "deg", "that axis, from x to y", [](const R& r) { return r.touch.tilt_axis_deg; });
  number("drawn/force_N", "N", "normal force asked for; NaN where depth was",
         [](const R& r) { return r.touch.force_N; });
  number("drawn/depth_mm", "mm", "depth of the lowest point asked for; NaN where force was",
         [](const R& r) { return r.touch.depth_mm; });
  number("drawn/drag_mm", "mm", "along the surface, after the press", [](const R& r) { return r.touch.drag_mm; });
  number("drawn/drag_toward_deg", "deg", "from x to y", [](const R& r) { return r.touch.drag_toward_deg; });
}

template <typename T>
std::vector<T> column(const Hdf5Reader& file, const std::string& path, std::int64_t rows) {
  Hdf5Array<T> array = file.read<T>(path);
  if (array.shape != std::vector<std::int64_t>{rows}) fail("array '{}' has another shape than it should", path);
  return std::move(array.values);
}

BlockColumns columns_in(const fs::path& path, std::int64_t n) {
  const Hdf5Reader file(path);
  BlockColumns columns;
  try {
    columns.sample = column<std::int64_t>(file, "/sample", n);
    columns.unit = column<std::int32_t>(file, "/unit", n);
    columns.object = column<std::int32_t>(file, "/object", n);
    columns.split = column<std::int32_t>(file, "/split", n);
    columns.attempt = column<std::int32_t>(file, "/attempt", n);
    columns.deepest_mm = column<double>(file, "/deepest_mm", n);
    columns.contact_area_mm2 = column<double>(file, "/contact_area_mm2", n);
    columns.largest_strain = column<double>(file, "/largest_strain", n);
    columns.place_x_mm = column<double>(file, "/drawn/place_x_mm", n);
    columns.place_y_mm = column<double>(file, "/drawn/place_y_mm", n);
    columns.turn_deg = column<double>(file, "/drawn/turn_deg", n);
    columns.tilt_deg = column<double>(file, "/drawn/tilt_deg", n);
    columns.drag_mm = column<double>(file, "/drawn/drag_mm", n);
    for (const std::int32_t one : column<std::int32_t>(file, "/under_resolved", n)) columns.under_resolved += one;
    const std::vector<double> wrench = file.read<double>("/wrench").values;
    const std::vector<double> error = file.read<double>("/wrench_error").values;
    if (wrench.size() != static_cast<std::size_t>(6 * n) || error.size() != static_cast<std::size_t>(3 * n)) {
      fail("array '/wrench' has another shape than it should");
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
      columns.force_N.push_back(wrench[6 * i + 2]);
      columns.shear_N.push_back(std::hypot(wrench[6 * i], wrench[6 * i + 1]));
      columns.force_error_N.push_back(error[3 * i + 2]);
    }
    columns.light = file.text_attribute("/", "light");
  } catch (const Error& error) {
    fail("{}: {}", path.string(), error.what());
  }
  return columns;
}

}  // namespace

std::string block_name(const DrawnBlock& block) {
  return fmt::format("blocks/{:06}.h5", block.number);
}

void write_block(const fs::path& out, const std::string& identity, const PreparedDraw& prepared,
                 const DrawnBlock& block, const DrawnUnit& unit, const UnitSensor& sensor,
                 std::span<const BlockRecord> records) {
  TS_ASSERT(static_cast<std::int64_t>(records.size()) == block.samples);
  write_whole_file(out / block_name(block), [&](const fs::path& temporary) {
    Hdf5Writer file(temporary, kUserBlock);
    file.set_attribute("format", std::string(kFormat));
    file.set_attribute("format_version", std::int64_t{kFormatVersion});
    file.set_attribute("program", program_name());
    file.set_attribute("job", prepared.job.name);
    if (!prepared.job.licence.empty()) file.set_attribute("licence", prepared.job.licence);
    file.set_attribute("unit", std::int64_t{unit.number});
    file.set_attribute("light", sensor.light);
    file.write_texts({"/device_yaml", "1", "1", "", "the unit's device file, as drawn"}, {unit.text});
    std::vector<std::string> names;
    for (const DrawnObjectSpec& object : prepared.job.draw.objects) names.push_back(object.file.stem().string());
    file.write_texts({"/object_name", "1", "objects", "", "of the number in /object"}, names);
    Columns columns(file, records);
    const DrawnOutputs& wanted = prepared.job.outputs;
    if (!sensor.background.empty()) {
      const std::int64_t channels = sensor.background.channels();
      file.write<std::uint8_t>({"/background", "DN", channels == 3 ? "row x column x rgb" : "row x column x grey", "",
                                "the unit's frame untouched, with its noise"},
                               sensor.background.rows, {sensor.background.cols, channels}, bytes_of(sensor.background));
      write_pictures(columns, wanted, sensor.background);
    }
    write_fields(file, columns, wanted, sensor);
    if (wanted.events) write_events(file, columns, records);
    if (wanted.statistics) write_statistics(columns);
    write_labels(columns);
    file.close([&](std::string_view rest) { return head_of(identity, block, sha256_of(rest)); });
  });
}

BlockState state_of_block(const fs::path& out, const std::string& identity, const DrawnBlock& block) {
  const fs::path file = out / block_name(block);
  std::error_code error;
  if (!fs::exists(file, error)) return BlockState::absent;
  const std::string content = read_whole_file(file);
  if (content.size() <= kUserBlock) return BlockState::damaged;
  const std::string head = content.substr(0, content.find('\n'));
  ordered_json read;
  std::string sha256;
  try {
    read = ordered_json::parse(head);
    if (read.at("format") != kFormat) return BlockState::damaged;
    sha256 = read.at("sha256");
  } catch (const nlohmann::json::exception&) {
    return BlockState::damaged;
  }
  if (sha256_of(std::string_view(content).substr(kUserBlock)) != sha256) return BlockState::damaged;
  return head + "\n" == head_of(identity, block, sha256) ? BlockState::whole : BlockState::foreign;
}

BlockColumns read_block_columns(const fs::path& out, const DrawnBlock& block) {
  const fs::path path = out / block_name(block);
  return read_hdf5(path, [&] { return columns_in(path, block.samples); });
}

}  // namespace touchstone::datasets
