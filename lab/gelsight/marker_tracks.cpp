#include "lab/gelsight/marker_tracks.h"

#include <fmt/format.h>

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/whole_file_writer.h"
#include "datasets/sets/csv_cells.h"
#include "sensors/markers/marker_overlay.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "sequence,frame,file,t_us,marker,x_px,y_px,dx_px,dy_px,trusted,status\n";

/// What all lines of a frame begin with.
std::string line_start(const std::string& sequence, const datasets::LabelledFrame& frame) {
  return fmt::format("{},{},{},{},", datasets::csv_cell(sequence), frame.frame,
                     datasets::csv_cell(frame.file.filename().string()),
                     frame.timed ? fmt::format("{}", frame.t_us) : std::string());
}

/// The line of a frame that can't be used.
std::string marker_fault_line(const std::string& start, const std::string& fault) {
  return fmt::format("{},,,,,0,{}\n", start, datasets::csv_cell(fault));
}

void add_markers(const std::string& start, const sensors::TrackedMarkers& markers, std::string& csv) {
  for (std::size_t i = 0; i < markers.rest.size(); ++i) {
    const Eigen::Vector2d& place = markers.positions[i];
    const Eigen::Vector2d moved = markers.displacement(i);
    csv += fmt::format("{}{},{:.4f},{:.4f},{:.4f},{:.4f},{},{}\n", start, i, place.x(), place.y(), moved.x(), moved.y(),
                       markers.trusted(i) ? 1 : 0, sensors::name_of(markers.status[i]));
  }
}

/// Follows one sequence's markers, and reads touches if they are wanted.
class Follower {
 public:
  /// Has seen the gel at rest. @throws Error for a picture that doesn't show it
  Follower(const cv::Mat& rest, const std::optional<sensors::TouchCalibration>& touch) {
    if (touch) {
      reader_.emplace(sensors::at_rest(*touch, rest));
    } else {
      tracker_.emplace(sensors::MarkerTrackerSettings{});
      tracker_->track({rest, std::numeric_limits<std::int64_t>::min()});  // before any frame, whatever their clock
    }
  }

  /// None if touches aren't read. @throws Error for a frame that can't be taken
  const sensors::TouchReading* read(const Frame& frame) {
    if (reader_) return &reader_->read(frame);
    tracker_->track(frame);
    return nullptr;
  }
  const sensors::MarkerTracker& tracker() const { return reader_ ? reader_->tracker() : *tracker_; }
  const sensors::TrackedMarkers& markers() const { return tracker().tracked(); }

 private:
  std::optional<sensors::MarkerTracker> tracker_;
  std::optional<sensors::TouchReader> reader_;
};

/// What is written of all sequences.
class Tables {
 public:
  Tables(const fs::path& folder, bool touch) : markers_(folder / "markers.csv") {
    markers_.append(kHeader);
    if (!touch) return;
    touches_.emplace(folder / "touch.csv");
    touches_->append(touch_header());
  }
  void add(const std::string& markers, const std::string& touch) {
    markers_.append(markers);
    if (touches_) touches_->append(touch);
  }
  void add_fault(const std::string& start, const std::string& fault) {
    add(marker_fault_line(start, fault), touch_fault_line(start, fault));
  }
  void finish() {
    markers_.finish();
    if (touches_) touches_->finish();
  }

 private:
  WholeFileWriter markers_;
  std::optional<WholeFileWriter> touches_;
};

/// A sequence that has been opened.
struct Opened {
  std::unique_ptr<datasets::FrameSource> source;
  std::optional<datasets::SourceFrame> first;  ///< if it has been taken from the source
  std::unique_ptr<Follower> follower;          ///< has seen the gel at rest
  std::string refused = {};                    ///< why there's no follower
};

/// Opens a sequence and shows its gel at rest to a follower, as far as that can be done.
Opened opened(const datasets::FrameStream& stream, const MarkerTrackSettings& settings) {
  Opened one;
  one.source = stream.open();
  if (settings.rest.empty() && !stream.rest) {
    one.first.emplace();
    if (!one.source->next(*one.first)) fail("{}: has no frame", stream.name);
  }
  std::string name = settings.rest.string();
  try {
    cv::Mat rest;
    if (!settings.rest.empty()) {
      rest = sim::read_image(settings.rest);
    } else if (stream.rest) {
      name = stream.name + ": its background";
      rest = stream.rest();
    } else {
      name = one.first->title;
      if (!one.first->fault.empty()) fail("{}", one.first->fault);
      rest = one.first->image;
    }
    one.follower = std::make_unique<Follower>(rest, settings.touch);
  } catch (const Error& error) {
    const std::string message = error.what();
    const bool named = name.empty() || message.find(name) != std::string::npos;
    one.refused = fmt::format("{}{}{} (this is the frame at rest; --rest names another)", named ? "" : name,
                              named ? "" : ": ", message);
  }
  return one;
}

/// @param one whose follower has seen the gel at rest
MarkerTrack follow(const datasets::FrameStream& stream, Opened& one, const MarkerTrackSettings& settings,
                   const fs::path& overlays, Tables& tables, const std::function<void()>& frame_done) {
  MarkerTrack track;
  track.sequence = stream.name;
  Follower& follower = *one.follower;
  track.appearance = follower.tracker().appearance().value();
  track.appearance.spacing_px = follower.tracker().spacing_px();  // between centres, where learning is good to pixels
  track.markers = static_cast<int>(follower.markers().rest.size());
  cv::Mat picture;
  const auto read = [&](const datasets::SourceFrame& frame) {
    const datasets::LabelledFrame& label = frame.label;
    const std::string start = line_start(stream.name, label);
    std::string lines, touch_text;
    std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
      const sensors::TouchReading* touch = follower.read({image, label.t_us});
      const sensors::TrackedMarkers& markers = follower.markers();
      add_markers(start, markers, lines);
      if (touch != nullptr) {
        touch_text = touch_line(start, *touch);
        track.touches.add(*touch, label.force);
      }
      ++track.frames;
      track.places += static_cast<std::int64_t>(markers.rest.size());
      for (std::size_t i = 0; i < markers.rest.size(); ++i) track.trusted += markers.trusted(i) ? 1 : 0;
      if (markers.jumped && track.jumped_at < 0) track.jumped_at = label.frame;
      if (settings.overlay || settings.show) {
        sensors::draw_overlay(image, markers, track.appearance, picture, {.arrow_scale = settings.arrow_scale});
      }
    });
    if (!fault.empty()) {
      tables.add_fault(start, fault);
      track.faults.push_back(std::move(fault));
    } else {
      tables.add(lines, touch_text);
      if (settings.overlay) sim::write_png(overlays / (frame.stem + ".png"), picture);
      if (settings.show) settings.show(picture);
    }
    frame_done();
  };
  if (one.first) read(*one.first);
  for (datasets::SourceFrame frame; one.source->next(frame);) read(frame);
  return track;
}

}  // namespace

std::vector<MarkerTrack> write_marker_tracks(const std::vector<datasets::FrameStream>& streams,
                                             const MarkerTrackSettings& settings, const fs::path& folder,
                                             const Progress& progress) {
  const std::int64_t total = datasets::frames_of(streams);
  std::int64_t done = 0;
  const auto frame_done = [&] {
    ++done;
    if (progress) progress("markers", done, total);
  };
  // All frames at rest come before anything is written. What is made of them isn't kept: of many sequences it's large.
  std::vector<std::string> refused;
  Opened only;
  for (const datasets::FrameStream& stream : streams) {
    Opened one = opened(stream, settings);
    if (!one.refused.empty() && (streams.size() == 1 || !settings.rest.empty())) fail("{}", one.refused);
    refused.push_back(one.refused);
    if (streams.size() == 1) only = std::move(one);
  }
  fs::create_directories(folder);
  std::vector<MarkerTrack> tracks;
  std::vector<std::string> faults;
  Tables tables(folder, settings.touch.has_value());
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const datasets::FrameStream& stream = streams[i];
    const fs::path overlays = folder / "overlay";
    if (refused[i].empty()) {
      if (settings.overlay) fs::create_directories(streams.size() > 1 ? overlays / stream.name : overlays);
      Opened again = streams.size() == 1 ? std::move(only) : opened(stream, settings);
      tracks.push_back(follow(stream, again, settings, overlays, tables, frame_done));
    } else {
      datasets::SourceFrame first;
      stream.open()->next(first);
      tables.add_fault(line_start(stream.name, first.label), refused[i]);
      MarkerTrack none;
      none.sequence = stream.name;
      none.faults.push_back(refused[i]);
      tracks.push_back(std::move(none));
      done += stream.frames.value_or(0);
    }
    const MarkerTrack& track = tracks.back();
    if (track.frames == 0) faults.insert(faults.end(), track.faults.begin(), track.faults.end());
  }
  std::size_t without_frames = 0;
  for (const MarkerTrack& track : tracks) without_frames += track.frames == 0 ? 1U : 0U;
  if (without_frames == tracks.size()) {
    fail("none of {} frames can be used{}{}", done,
         faults.empty() ? "" : "; the first: ", faults.empty() ? "" : faults.front());
  }
  tables.finish();
  return tracks;
}

}  // namespace touchstone::lab
