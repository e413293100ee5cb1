// Frames of any source as an iterator: datasets/sources/any_source.h.

#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/units.h"
#include "datasets/sources/any_source.h"
#include "python/src/bindings.h"

namespace touchstone::python {
namespace {

constexpr std::int64_t kMostFrames = std::int64_t{1} << 40;

std::string place_from(const py::object& source) {
  if (!PyLong_Check(source.ptr()) || PyBool_Check(source.ptr())) return needed_path(source, "source");
  return std::to_string(whole_number_from<int>(source, "source", 0));
}

/// While a live source is waited for: Ctrl-C ends the wait.
bool look_for_signals() {
  const py::gil_scoped_acquire acquire;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  return false;
}

/// Goes through the streams of a source. For one thread.
class Frames {
 public:
  explicit Frames(const datasets::SourceChoice& choice)
      : streams_(unlocked([&] { return datasets::streams_of(choice); })) {}

  ~Frames() {
    const py::gil_scoped_release release;  // a live source's thread is waited for
    source_.reset();
  }
  Frames(const Frames&) = delete;
  Frames& operator=(const Frames&) = delete;

  /// (seconds, picture); what can't be read is left out, with a warning. @throws StopIteration at the end
  py::tuple next() {
    for (;;) {
      datasets::SourceFrame frame;
      if (!unlocked([&] { return take(frame); })) throw py::stop_iteration();
      if (!frame.fault.empty()) {
        faults_.push_back(frame.fault);
        if (PyErr_WarnEx(PyExc_UserWarning, (frame.fault + ": left out").c_str(), 1) != 0)
          throw py::error_already_set();
        continue;
      }
      shown_ = std::move(frame);
      const auto& label = shown_->label;
      const py::object seconds =
          label.timed ? py::object(py::float_(static_cast<double>(label.t_us) / kMicrosecondsPerSecond)) : py::none();
      return py::make_tuple(seconds, array_of(std::exchange(shown_->image, cv::Mat())));
    }
  }

  const datasets::SourceFrame& shown() const {
    if (!shown_) fail("there is no frame yet");
    return *shown_;
  }
  const std::string& sequence() const {
    if (now_ == 0) fail("there is no frame yet");
    return streams_[now_ - 1].name;
  }
  py::object rest() const {
    const std::size_t of = now_ == 0 ? 0 : now_ - 1;
    if (streams_.empty() || !streams_[of].rest) return py::none();
    return array_of(unlocked([&] { return streams_[of].rest(); }));
  }
  std::optional<std::int64_t> count() const {
    const std::int64_t known = datasets::frames_of(streams_);
    return known > 0 ? std::optional(known) : std::nullopt;
  }
  const std::vector<std::string>& faults() const { return faults_; }

 private:
  bool take(datasets::SourceFrame& frame) {
    for (;;) {
      if (!source_) {
        if (now_ == streams_.size()) return false;
        source_ = streams_[now_++].open();
      }
      if (source_->next(frame)) return true;
      source_.reset();
    }
  }

  std::vector<datasets::FrameStream> streams_;
  std::size_t now_ = 0;
  std::unique_ptr<datasets::FrameSource> source_;
  std::optional<datasets::SourceFrame> shown_;
  std::vector<std::string> faults_;
};

std::unique_ptr<Frames> frames_from(const py::object& source, const py::object& rate, const py::object& times,
                                    const py::object& split, const py::object& count, const py::object& seconds,
                                    const py::object& timeout) {
  datasets::SourceChoice choice;
  choice.place = place_from(source);
  const auto positive = [](const py::object& value, const char* what) {
    if (value.is_none()) return 0.0;
    const double number = number_from(value, what);
    if (!(number > 0.0)) fail("{}: {} isn't allowed; it must be above 0", what, number);
    return number;
  };
  choice.rate_Hz = positive(rate, "rate");
  choice.most_s = positive(seconds, "seconds");
  choice.timeout_s = positive(timeout, "timeout");
  if (!times.is_none()) choice.times = needed_path(times, "times");
  if (!count.is_none()) choice.most_frames = whole_number_from<std::int64_t>(count, "count", 1, kMostFrames);
  if (!split.is_none()) {
    const std::string name = text_from(split, "split");
    if (name != "all") choice.split = datasets::split_named(name);
    choice.split_given = true;
  }
  choice.stopped = look_for_signals;
  return std::make_unique<Frames>(choice);
}

}  // namespace

void bind_frames(py::module_& module) {
  py::class_<Frames>(
      module, "frames",
      R"(Frames of any source, one after the other: for seconds, picture in touchstone.frames("clip.mp4").

source: a folder of pictures in natural order of their names, a picture, a video file, a data set of ours, a camera's
  number (an int), or an address (http://, https://, rtsp://), such as that of `touchstone serve`.
rate: frames a second, in place of the times that a recording has. times: a CSV file with the header file,t_us,
  file,t_s, frame,t_us or frame,t_s. split: of a data set ("train", "validate", "test" or "all").
count, seconds: end after so many frames, or so long after the first one. timeout: how long a camera or an address is
  waited for, and each of its frames, s.

Gives (seconds, picture): seconds is None where nobody knows when a frame was taken; of a live source it counts from the
first frame. Pictures are uint8 or uint16, grey or BGR. A frame that can't be read is left out, with a UserWarning, and
named in `faults`. Only a few frames are in memory. Raises Error if the source can't be opened.)")
      .def(py::init(&frames_from), py::arg("source"), py::kw_only(), py::arg("rate") = py::none(),
           py::arg("times") = py::none(), py::arg("split") = py::none(), py::arg("count") = py::none(),
           py::arg("seconds") = py::none(), py::arg("timeout") = 10.0)
      .def("__iter__", [](Frames& self) -> Frames& { return self; })
      .def("__next__", &Frames::next)
      .def_property_readonly(
          "name", [](const Frames& frames) { return text_of(frames.shown().stem); },
          "What the last frame is called: its file's name without ending, or \"clip-000012\".")
      .def_property_readonly(
          "number", [](const Frames& frames) { return frames.shown().label.frame; },
          "The last frame's number within its sequence.")
      .def_property_readonly(
          "sequence", [](const Frames& frames) { return text_of(frames.sequence()); },
          "The last frame's sequence: a data set has several.")
      .def_property_readonly(
          "force_N",
          [](const Frames& frames) -> py::object {
            const auto& force = frames.shown().label.force;
            return force ? py::object(small_array(*force)) : py::none();
          },
          "The true force on the object at the last frame, of a data set; else None.")
      .def_property_readonly("rest", &Frames::rest,
                             "The picture at rest, of a drawn data set's unit; else None: the first frame shows it.")
      .def_property_readonly("count", &Frames::count, "How many frames there will be; None where that isn't known.")
      .def_property_readonly(
          "faults",
          [](const Frames& frames) {
            py::list all;
            for (const std::string& fault : frames.faults()) all.append(text_of(fault));
            return all;
          },
          "What was wrong with the frames that were left out so far.");
}

}  // namespace touchstone::python
