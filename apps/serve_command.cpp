#include <fmt/ranges.h>
#include <malloc.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <map>
#include <memory>
#include <mutex>

#include "apps/command.h"
#include "apps/event_server.h"
#include "apps/frame_server.h"
#include "apps/press_request.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "core/nearest_name.h"
#include "core/short_text.h"
#include "core/yaml_reader.h"
#include "datasets/jobs/scenes_folder.h"
#include "lab/device/camera_feed.h"

namespace touchstone::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMostLight_bytes = 4'000'000'000;
constexpr int kMmapThreshold_bytes = 128 * 1024;  // malloc's own at the start

struct ServeOptions {
  fs::path what;
  std::vector<fs::path> objects;
  std::string address = "127.0.0.1";
  int port = 8080;
  std::optional<int> events_port;
  double rate_Hz = 0.0;
  int quality = 95;
  std::vector<int> frames;
  AllowedSources sources;
  double patience_s = 10.0;
};

// A signal's handler may only write to this.
int signal_pipe = -1;

void on_signal(int) {
  const int before = errno;
  const char byte = 0;
  if (::write(signal_pipe, &byte, 1) < 0) {
    // Nothing can be done here; the pipe is full only if a signal is already in it.
  }
  errno = before;
}

/// Waits for SIGINT or SIGTERM.
class StopSignal {
 public:
  StopSignal() {
    if (::pipe(ends_.data()) != 0) fail("no pipe can be had");
    signal_pipe = ends_[1];
    struct sigaction action {};
    action.sa_handler = &on_signal;
    for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
  }
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  void wait() {
    char byte = 0;
    while (::read(ends_[0], &byte, 1) < 0 && errno == EINTR) {
    }
  }

 private:
  std::array<int, 2> ends_{};  // open to the program's end: a late signal may still come
};

void say_where(const ServeOptions& options, const FrameServer& server) {
  fmt::print("frames: http://{0}:{1}/stream.mjpg (/frame.jpg, /status.json, /truth.json?frame=N)\n", options.address,
             server.port());
}

/// Says `last`, the line at which who started the program knows that it serves, and waits.
void wait_until_stopped(const std::string& last) {
  StopSignal stop;
  fmt::print("{}; Ctrl-C stops\n", last);
  std::fflush(stdout);
  stop.wait();
}

void serve_scene(const ServeOptions& options, const GlobalOptions& global) {
  if (!options.objects.empty()) fail("--object: {} is a scene and has its objects", options.what.string());
  std::optional<std::pair<int, int>> first_last;
  if (!options.frames.empty()) first_last = std::pair(options.frames[0], options.frames[1]);
  const sim::SceneSpec scene = sim::read_scene(options.what);
  if (options.events_port && !scene.outputs.events) {
    fail("--events-port: the scene's outputs have no events: {}", options.what.string());
  }
  lab::SceneFeed feed;
  {
    ProgressBar bar(global.quiet);
    feed = lab::feed_of_scene(scene, global.cache, first_last, kMostLight_bytes, bar.listener());
  }
  const double rate = options.rate_Hz > 0.0 ? options.rate_Hz : feed.frame_rate_Hz;
  ServedCamera camera(feed.states, rate, options.quality);
  FramePages::Contents contents{feed.device, options.sources, {}};
  if (!feed.has_events) {  // events can't stand still
    contents.commands["/hold"] = {[&](const Requested& requested) {
                                    allow_only(requested, {"frame"});
                                    camera.hold(count_of(requested, "frame"));
                                  },
                                  "frame=0"};
    contents.commands["/run"] = {[&](const Requested& requested) {
      allow_only(requested, {});
      camera.hold(std::nullopt);
    }};
  }
  std::unique_ptr<EventServer> events;
  if (feed.has_events) {
    events = std::make_unique<EventServer>(
        EventLoop{std::move(feed.events), feed.period_us, rate / feed.frame_rate_Hz, feed.size}, options.address,
        options.events_port.value_or(options.port == 0 ? 0 : options.port + 1), options.patience_s);
  }
  const FrameServer server(camera, contents, {options.address, options.port, options.patience_s});
  say_where(options, server);
  if (events) fmt::print("events: tcp://{}:{} (EVT 3.0)\n", options.address, events->port());
  wait_until_stopped(fmt::format("{} frames again and again at {:g} Hz", feed.states.size(), rate));
}

/// Objects that may press a device: the shipped ones and those of the command line, by name.
class Objects {
 public:
  Objects(const sim::VirtualSensor& device, const std::vector<fs::path>& files) : device_(device) {
    const fs::path shipped = datasets::scenes_folder() / "objects";
    for (const auto& entry : fs::directory_iterator(shipped)) {
      if (entry.path().extension() == ".yaml") files_[entry.path().stem().string()] = entry.path();
    }
    for (const fs::path& file : files) {
      sim::read_object(file);  // a mistake in it is reported now
      files_[file.stem().string()] = file;
    }
  }

  const sim::TouchObject& named(const std::string& name) {
    const auto file = files_.find(name);
    if (file == files_.end()) {
      std::vector<std::string> known;
      for (const auto& [one, ignored] : files_) known.push_back(one);
      fail("object: '{}' isn't known{}; there are: {}", short_text(name), did_you_mean(name, known),
           fmt::join(known, ", "));
    }
    const auto kept = made_.find(name);
    if (kept != made_.end()) return kept->second;
    const sim::TouchObject& made = made_.emplace(name, device_.object(sim::read_object(file->second))).first->second;
    if (!made.warning().empty()) spdlog::warn("{}", made.warning());
    return made;
  }

 private:
  const sim::VirtualSensor& device_;
  std::map<std::string, fs::path> files_;
  std::map<std::string, sim::TouchObject> made_;
};

void serve_device(const ServeOptions& options, const GlobalOptions& global) {
  if (!options.frames.empty()) fail("--frames: {} is a device and has no frames", options.what.string());
  if (options.events_port) fail("--events-port: {} is a device; events want a scene", options.what.string());
  const sim::DeviceSpec spec = sim::read_device(options.what);
  const sim::VirtualSensor device(spec, global.cache);
  Objects objects(device, options.objects);
  const std::string usual = options.objects.empty() ? "ball-8mm" : options.objects.front().stem().string();
  const ServedCamera::States rest = {std::make_shared<const lab::CameraState>(lab::camera_state(device.rest()))};
  const double rate = options.rate_Hz > 0.0 ? options.rate_Hz : spec.camera->frame_rate_Hz;
  ServedCamera camera(rest, rate, options.quality);
  std::mutex pressing;  // one after the other
  FramePages::Contents contents{spec.name, options.sources, {}};
  const std::string example = fmt::format("object={}&x_mm=0&y_mm=0&force_N=1", usual);
  const auto press = [&](const Requested& requested) {
    const sim::PressSpec wanted = press_of(requested);
    const auto name = requested.find("object");
    const std::lock_guard<std::mutex> lock(pressing);
    const sim::Touch held = device.press(objects.named(name == requested.end() ? usual : name->second), wanted);
    camera.show({std::make_shared<const lab::CameraState>(lab::camera_state(held))});
  };
  contents.commands["/press"] = {press, example};
  contents.commands["/release"] = {[&](const Requested& requested) {
    allow_only(requested, {});
    const std::lock_guard<std::mutex> lock(pressing);
    camera.show(rest);
  }};
  const FrameServer server(camera, contents, {options.address, options.port, options.patience_s});
  say_where(options, server);
  fmt::print("press: curl -d '{}' http://{}:{}/press (/release)\n", example, options.address, server.port());
  wait_until_stopped(fmt::format("{}, untouched, at {:g} Hz", spec.name, rate));
}

void serve(const ServeOptions& options, const GlobalOptions& global) {
  check(options.sources);
  // What a press takes for a moment is kept for the next one by each arena, of which all threads together would
  // have 16.
  ::mallopt(M_ARENA_MAX, 1);
  // And pictures of a press go back to the system at once. Left to itself malloc soon takes pieces up to 32 MB from the
  // heap, where what is remembered of each press comes to lie between them: 0.35 MB a press at 640 x 480 pixels.
  ::mallopt(M_MMAP_THRESHOLD, kMmapThreshold_bytes);
  const YamlReader file = YamlReader::open(options.what);
  if (file.has("gel")) return serve_device(options, global);
  if (file.has("device")) return serve_scene(options, global);
  fail("{}: is neither a device (which has a gel) nor a scene (which has a device)", options.what.string());
}

}  // namespace

void add_serve_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand(
      "serve", "Be the camera: a scene's frames, or a device's that is pressed on request, as MJPEG over HTTP");
  auto options = std::make_shared<ServeOptions>();
  command->add_option("WHAT", options->what, "Scene or device file")->required();
  command->add_option("--object", options->objects, "A device's: further objects that may press it, by their files");
  command->add_option("--address", options->address, "Where to listen; 0.0.0.0 is all of the machine's addresses")
      ->capture_default_str();
  command->add_option("--port", options->port, "Of HTTP; 0 takes any free one, which is printed")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command->add_option("--events-port", options->events_port, "Of a scene's events (default: --port and one)")
      ->check(CLI::Range(0, 65535));
  command->add_option("--rate", options->rate_Hz, "Frames a second (default: the scene's or the device's own)")
      ->check(CLI::Range(0.01, 10000.0));
  command->add_option("--quality", options->quality, "Of the JPEGs")->check(CLI::Range(1, 100))->capture_default_str();
  command->add_option("--frames", options->frames, "A scene's: only from the first to the last of these")->expected(2);
  command->add_option("--host", options->sources.hosts,
                      "A name under which requests may ask for this machine, as sensor.local; addresses and localhost "
                      "always may");
  command->add_option("--allow-origin", options->sources.origins,
                      "A web page that may use the server, as http://localhost:3000; no other may");
  command
      ->add_option("--patience", options->patience_s,
                   "Seconds that a client may take to send a request or to take a frame")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->callback([&action, &global, options] { action = [options, &global] { serve(*options, global); }; });
}

}  // namespace touchstone::apps
