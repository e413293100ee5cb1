#include "lab/gelsight/marker_tracks.h"

#include <fmt/format.h>

#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "sensors/markers/marker_overlay.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "sequence,frame,file,t_us,marker,x_px,y_px,dx_px,dy_px,trusted,status\n";

/// What all lines of a frame begin with.
std::string line_start(const std::string& sequence, const datasets::LabelledFrame& frame, bool times_known) {
  return fmt::format("{},{},{},{},", datasets::csv_cell(sequence), frame.frame,
                     datasets::csv_cell(frame.file.filename().string()),
                     times_known ? fmt::format("{}", frame.t_us) : std::string());
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
  /// Has seen the gel at rest. @throws Error naming the picture
  Follower(const fs::path& rest, const std::optional<sensors::TouchCalibration>& touch) {
    datasets::on_picture(rest, [&](const cv::Mat& image) {
      if (touch) {
        reader_.emplace(sensors::at_rest(*touch, image));
      } else {
        tracker_.emplace(sensors::MarkerTrackerSettings{});
        tracker_->track({image, std::numeric_limits<std::int64_t>::min()});  // before any frame, whatever their clock
      }
    });
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
struct Tables {
  std::string markers = kHeader;
  std::string touches = touch_header();
};

/// @param follower has seen the gel at rest
MarkerTrack follow(const datasets::FrameSequence& sequence, Follower& follower, const MarkerTrackSettings& settings,
                   const fs::path& overlays, Tables& tables, const std::function<void()>& frame_done) {
  MarkerTrack track;
  track.sequence = sequence.name;
  track.appearance = follower.tracker().appearance().value();
  track.appearance.spacing_px = follower.tracker().spacing_px();  // between centres, where learning is good to pixels
  track.markers = static_cast<int>(follower.markers().rest.size());
  cv::Mat picture;
  for (const datasets::LabelledFrame& frame : sequence.frames) {
    const std::string start = line_start(sequence.name, frame, settings.times_known);
    std::string fault = datasets::fault_on_picture(frame.file, [&](const cv::Mat& image) {
      const sensors::TouchReading* touch = follower.read({image, frame.t_us});
      const sensors::TrackedMarkers& markers = follower.markers();
      add_markers(start, markers, tables.markers);
      if (touch != nullptr) {
        tables.touches += touch_line(start, *touch);
        track.touches.add(*touch, frame.force);
      }
      ++track.frames;
      track.places += static_cast<std::int64_t>(markers.rest.size());
      for (std::size_t i = 0; i < markers.rest.size(); ++i) track.trusted += markers.trusted(i) ? 1 : 0;
      if (markers.jumped && track.jumped_at < 0) track.jumped_at = frame.frame;
      if (settings.overlay) {
        sensors::draw_overlay(image, markers, track.appearance, picture, {.arrow_scale = settings.arrow_scale});
      }
    });
    if (!fault.empty()) {
      tables.markers += marker_fault_line(start, fault);
      tables.touches += touch_fault_line(start, fault);
      track.faults.push_back(std::move(fault));
    } else if (settings.overlay) {
      sim::write_png(overlays / frame.file.filename().replace_extension(".png"), picture);
    }
    frame_done();
  }
  return track;
}

}  // namespace

std::vector<MarkerTrack> write_marker_tracks(const std::vector<datasets::FrameSequence>& sequences,
                                             const MarkerTrackSettings& settings, const fs::path& folder,
                                             const Progress& progress) {
  std::int64_t total = 0, done = 0;
  for (const datasets::FrameSequence& sequence : sequences) total += std::ssize(sequence.frames);
  const auto frame_done = [&] {
    ++done;
    if (progress) progress("markers", done, total);
  };
  const auto rest_of = [&](const datasets::FrameSequence& sequence) {
    return settings.rest.empty() ? sequence.frames.front().file : settings.rest;
  };
  // All frames at rest come before anything is written. What is made of them isn't kept: of many sequences it's large.
  std::vector<std::string> refused;
  for (const datasets::FrameSequence& sequence : sequences) {
    refused.emplace_back();
    try {
      const Follower follower(rest_of(sequence), settings.touch);
    } catch (const Error& error) {
      refused.back() = fmt::format("{} (this is the frame at rest; --rest names another)", error.what());
      if (sequences.size() == 1 || !settings.rest.empty()) fail("{}", refused.back());
    }
  }
  fs::create_directories(folder);
  std::vector<MarkerTrack> tracks;
  std::vector<std::string> faults;
  Tables tables;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    const datasets::FrameSequence& sequence = sequences[i];
    const fs::path overlays = folder / "overlay" / (sequences.size() > 1 ? sequence.name : "");
    if (refused[i].empty()) {
      if (settings.overlay) fs::create_directories(overlays);
      Follower follower(rest_of(sequence), settings.touch);
      tracks.push_back(follow(sequence, follower, settings, overlays, tables, frame_done));
    } else {
      const std::string start = line_start(sequence.name, sequence.frames.front(), settings.times_known);
      tables.markers += marker_fault_line(start, refused[i]);
      tables.touches += touch_fault_line(start, refused[i]);
      MarkerTrack none;
      none.sequence = sequence.name;
      none.faults.push_back(refused[i]);
      tracks.push_back(std::move(none));
      done += std::ssize(sequence.frames);
    }
    const MarkerTrack& track = tracks.back();
    if (track.frames == 0) faults.insert(faults.end(), track.faults.begin(), track.faults.end());
  }
  std::size_t without_frames = 0;
  for (const MarkerTrack& track : tracks) without_frames += track.frames == 0 ? 1U : 0U;
  if (without_frames == tracks.size()) fail("none of {} frames can be used; the first: {}", total, faults.front());
  write_whole_file(folder / "markers.csv", tables.markers);
  if (settings.touch) write_whole_file(folder / "touch.csv", tables.touches);
  return tracks;
}

}  // namespace touchstone::lab
