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
#include "sensors/markers/touch_overlay.h"
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

/// A frame of a recording by its number. @throws Error if it can't be read
cv::Mat frame_numbered(const datasets::FrameStream& stream, int number) {
  const std::unique_ptr<datasets::FrameSource> source = stream.open();
  for (datasets::SourceFrame frame; source->next(frame);) {
    if (frame.label.frame != number) continue;
    if (!frame.fault.empty()) fail("{}", frame.fault);
    return frame.image;
  }
  fail("{}: has no frame {}", stream.name, number);
}

/// Is a sequence's first frame its gel at rest?
bool rests_at_first(const datasets::FrameStream& stream, const MarkerTrackSettings& settings) {
  return settings.rest.empty() && !stream.rest;
}

/// Opens a sequence and shows its gel at rest to a follower, as far as that can be done.
/// @param rest_frame the frame that shows it; -1: as the settings and the stream say
Opened opened(const datasets::FrameStream& stream, const MarkerTrackSettings& settings, int rest_frame) {
  Opened one;
  one.source = stream.open();
  if (rests_at_first(stream, settings) && rest_frame < 0) {
    one.first.emplace();
    if (!one.source->next(*one.first)) fail("{}: has no frame", stream.name);
  }
  std::string name = settings.rest.string();
  try {
    cv::Mat rest;
    if (rest_frame >= 0) {
      rest = frame_numbered(stream, rest_frame);
    } else if (!settings.rest.empty()) {
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

/// Notes what a frame says of the frame at rest.
class RestSearch {
 public:
  void see(int frame, const sensors::TrackedMarkers& markers, MarkerTrack& track) {
    if (!markers.rest_was_touched) return;
    if (track.touched_at_rest_seen < 0) track.touched_at_rest_seen = frame;
    const sensors::RestDoubt& doubt = markers.rest_doubt;
    const bool whole = markers.found() == static_cast<int>(markers.rest.size()) && !markers.jumped;
    if (!whole || !doubt.rest_was_touched() || doubt.bend_px >= least_px_) return;
    least_px_ = doubt.bend_px;
    track.better_rest = frame;
  }

 private:
  double least_px_ = std::numeric_limits<double>::infinity();
};

/// @param one whose follower has seen the gel at rest
MarkerTrack follow(const datasets::FrameStream& stream, Opened& one, const MarkerTrackSettings& settings,
                   Tables& tables, const std::function<void()>& frame_done) {
  MarkerTrack track;
  track.sequence = stream.name;
  Follower& follower = *one.follower;
  track.appearance = follower.tracker().appearance().value();
  track.appearance.spacing_px = follower.tracker().spacing_px();  // between centres, where learning is good to pixels
  track.markers = static_cast<int>(follower.markers().rest.size());
  cv::Mat picture;
  RestSearch search;
  const auto read = [&](const datasets::SourceFrame& frame) {
    const datasets::LabelledFrame& label = frame.label;
    const std::string start = line_start(stream.name, label);
    std::string lines, touch_text;
    std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
      const sensors::TouchReading* touch = follower.read({image, label.t_us});
      const sensors::TrackedMarkers& markers = follower.markers();
      add_markers(start, markers, lines);
      if (touch != nullptr) {
        touch_text = touch_line(start, *touch, label.force);
        track.touches.add(*touch, label.force);
      }
      ++track.frames;
      track.places += static_cast<std::int64_t>(markers.rest.size());
      for (std::size_t i = 0; i < markers.rest.size(); ++i) track.trusted += markers.trusted(i) ? 1 : 0;
      if (markers.jumped && track.jumped_at < 0) track.jumped_at = label.frame;
      search.see(label.frame, markers, track);
      if (settings.show) {
        sensors::draw_overlay(image, markers, track.appearance, picture, {.arrow_scale = settings.arrow_scale});
        if (touch != nullptr) sensors::draw_touch(*touch, picture, {.full_force_N = settings.full_force_N});
      }
    });
    if (!fault.empty()) {
      tables.add_fault(start, fault);
      track.faults.push_back(std::move(fault));
    } else {
      tables.add(lines, touch_text);
      if (settings.show) settings.show(frame, picture);
    }
    frame_done();
  };
  if (one.first) read(*one.first);
  for (datasets::SourceFrame frame; one.source->next(frame);) read(frame);
  return track;
}

/// All frames once. @param rests of each stream the frame that shows its gel at rest; -1: as `opened` says
/// @param frame_done called for each frame @param tables are finished by who calls
std::vector<MarkerTrack> follow_all(const std::vector<datasets::FrameStream>& streams,
                                    const MarkerTrackSettings& settings, const std::vector<int>& rests,
                                    const fs::path& folder, std::optional<Tables>& tables,
                                    const std::function<void(std::int64_t frames)>& frames_done) {
  // All frames at rest come before anything is written. What is made of them isn't kept: of many sequences it's large.
  std::vector<std::string> refused;
  Opened only;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    Opened one = opened(streams[i], settings, rests[i]);
    if (!one.refused.empty() && (streams.size() == 1 || !settings.rest.empty())) fail("{}", one.refused);
    refused.push_back(one.refused);
    if (streams.size() == 1) only = std::move(one);
  }
  fs::create_directories(folder);
  tables.emplace(folder, settings.touch.has_value());
  std::vector<MarkerTrack> tracks;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const datasets::FrameStream& stream = streams[i];
    if (refused[i].empty()) {
      Opened again = streams.size() == 1 ? std::move(only) : opened(stream, settings, rests[i]);
      tracks.push_back(follow(stream, again, settings, *tables, [&] { frames_done(1); }));
      tracks.back().rest_frame = rests[i];
    } else {
      datasets::SourceFrame first;
      stream.open()->next(first);
      tables->add_fault(line_start(stream.name, first.label), refused[i]);
      MarkerTrack none;
      none.sequence = stream.name;
      none.faults.push_back(refused[i]);
      tracks.push_back(std::move(none));
      frames_done(stream.frames.value_or(0));
    }
  }
  return tracks;
}

/// @throws Error if no frame could be used
void require_frames(const std::vector<MarkerTrack>& tracks, std::int64_t done) {
  std::vector<std::string> faults;
  for (const MarkerTrack& track : tracks) {
    if (track.frames > 0) return;
    faults.insert(faults.end(), track.faults.begin(), track.faults.end());
  }
  fail("none of {} frames can be used{}{}", done,
       faults.empty() ? "" : "; the first: ", faults.empty() ? "" : faults.front());
}

}  // namespace

std::vector<MarkerTrack> write_marker_tracks(const std::vector<datasets::FrameStream>& streams,
                                             const MarkerTrackSettings& settings, const fs::path& folder,
                                             const Progress& progress) {
  std::int64_t total = datasets::frames_of(streams);
  std::int64_t done = 0;
  const auto frames_done = [&](std::int64_t frames) {
    done += frames;
    if (progress) progress("markers", done, total);
  };
  std::optional<Tables> tables;
  std::vector<int> rests(streams.size(), -1);
  std::vector<MarkerTrack> tracks = follow_all(streams, settings, rests, folder, tables, frames_done);
  require_frames(tracks, done);
  bool again = false;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    if (streams[i].live || !rests_at_first(streams[i], settings)) continue;
    rests[i] = tracks[i].better_rest;
    again |= rests[i] >= 0;
  }
  if (again) {
    tables.reset();  // unfinished: there are no such files
    if (settings.begin_again) settings.begin_again();
    total *= 2;
    tracks = follow_all(streams, settings, rests, folder, tables, frames_done);
  }
  tables->finish();
  return tracks;
}

}  // namespace touchstone::lab
