#include "apps/frame_server.h"

#include <fmt/ranges.h>
#include <httplib.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/error.h"
#include "core/nearest_name.h"
#include "core/short_text.h"
#include "plots/line_plot.h"

namespace touchstone::apps {
namespace {

constexpr int kMostStreams = 24;
constexpr int kThreads = 32;             // what streams leave over answers the rest
constexpr int kSendBuffer = 256 * 1024;  // old frames that wait for a slow client
constexpr int kWriteTimeout_s = 5;       // a client that takes nothing for so long is given up
constexpr const char* kBoundary = "touchstone-frame";
constexpr const char* kFrameHeader = "X-Touchstone-Frame";

/// httplib's own way shares a port between servers.
void set_socket(int socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
}

void answer_error(httplib::Response& response, int status, const std::string& message) {
  response.status = status;
  const nlohmann::json json = {{"error", message}};
  response.set_content(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n", "application/json");
}

std::string page(const std::string& title) {
  const std::string name = plots::escape_markup(title);
  return "<!DOCTYPE html><html lang=\"en\"><meta charset=\"utf-8\"><title>" + name + "</title><h1>" + name +
         "</h1><p><img src=\"/stream.mjpg\" alt=\"what the camera shows\"></p><p><a href=\"/frame.jpg\">one frame</a>, "
         "<a href=\"/status.json\">its truth</a></p></html>\n";
}

}  // namespace

struct FrameServer::Parts {
  Parts(ServedCamera& shown, Settings how) : camera(shown), settings(std::move(how)) {
    server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    server.set_socket_options(&set_socket);
    server.set_keep_alive_timeout(1);
    server.set_write_timeout(kWriteTimeout_s);
    server.Get("/", [this](const auto&, auto& response) { response.set_content(page(settings.title), "text/html"); });
    server.Get("/frame.jpg", [this](const auto&, auto& response) { one(response); });
    server.Get("/stream.mjpg", [this](const auto&, auto& response) { stream(response); });
    server.Get("/status.json", [this](const auto&, auto& response) { status(response); });
    server.Get("/truth.json", [this](const auto& request, auto& response) { truth(request, response); });
    for (const auto& [path, command] : settings.commands) {
      server.Post(path, [this, &command = command](const auto& request, auto& response) {
        carry_out(command, request, response);
      });
    }
  }

  void one(httplib::Response& response) {
    const auto frame = camera.latest();
    if (!frame) return answer_error(response, 503, "the camera is being stopped");
    response.set_header(kFrameHeader, std::to_string(frame->number));
    response.set_header("Cache-Control", "no-store");
    response.set_content(frame->jpeg, "image/jpeg");
  }

  void stream(httplib::Response& response) {
    if (++streams > kMostStreams) {
      --streams;
      return answer_error(response, 503, fmt::format("{} clients are served; no more are", kMostStreams));
    }
    response.set_header("Cache-Control", "no-store");
    auto last = std::make_shared<std::int64_t>(-1);
    response.set_content_provider(
        fmt::format("multipart/x-mixed-replace; boundary={}", kBoundary),
        [this, last](std::size_t, httplib::DataSink& sink) {
          const auto frame = *last < 0 ? camera.latest() : camera.next(*last);
          if (!frame) return false;
          *last = frame->number;
          const std::string head =
              fmt::format("--{}\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n{}: {}\r\n\r\n", kBoundary,
                          frame->jpeg.size(), kFrameHeader, frame->number);
          return sink.write(head.data(), head.size()) && sink.write(frame->jpeg.data(), frame->jpeg.size()) &&
                 sink.write("\r\n", 2);
        },
        [this](bool) { --streams; });
  }

  void status(httplib::Response& response) {
    const auto frame = camera.latest();
    if (!frame) return answer_error(response, 503, "the camera is being stopped");
    response.set_content(
        lab::to_json(*frame->state,
                     fmt::format("\"frame\":{},\"rate_Hz\":{},\"frames\":{},\"clients\":{},", frame->number,
                                 camera.rate_Hz(), camera.state_count(), streams.load())) +
            "\n",
        "application/json");
  }

  void truth(const httplib::Request& request, httplib::Response& response) {
    try {
      const Requested requested = values_of(request);
      allow_only(requested, {"frame"});
      const int number = count_of(requested, "frame");
      const auto state = camera.state_of(number);
      if (!state) fail("frame {} isn't due yet, or was too long ago", number);
      response.set_content(lab::to_json(*state, fmt::format("\"frame\":{},", number)) + "\n", "application/json");
    } catch (const Error& error) {
      answer_error(response, 400, error.what());
    }
  }

  void carry_out(const std::function<void(const Requested&)>& command, const httplib::Request& request,
                 httplib::Response& response) {
    try {
      command(values_of(request));
      // It holds from the next frame on.
      status_after_change(response);
    } catch (const Error& error) {
      answer_error(response, 400, error.what());
    }
  }

  void status_after_change(httplib::Response& response) {
    const auto frame = camera.latest();
    if (!frame) return answer_error(response, 503, "the camera is being stopped");
    const auto next = camera.next(frame->number);
    if (!next) return answer_error(response, 503, "the camera is being stopped");
    status(response);
  }

  static Requested values_of(const httplib::Request& request) {
    Requested values;
    for (const auto& [name, value] : request.params) {
      if (!values.emplace(name, value).second) fail("{}: stands twice in the request", short_text(name));
    }
    return values;
  }

  ServedCamera& camera;
  Settings settings;
  httplib::Server server;
  std::atomic<int> streams{0};
  int port = 0;
  std::atomic<bool> ended{false};
  std::thread listener;
};

FrameServer::FrameServer(ServedCamera& camera, Settings settings)
    : parts_(std::make_unique<Parts>(camera, std::move(settings))) {
  const Settings& how = parts_->settings;
  errno = 0;
  parts_->port = how.port == 0 ? parts_->server.bind_to_any_port(how.address)
                               : (parts_->server.bind_to_port(how.address, how.port) ? how.port : -1);
  if (parts_->port <= 0) {
    fail("can't listen at {}:{}{}; another --port may be free, --port 0 takes any", how.address, how.port,
         errno == 0 ? std::string() : fmt::format(": {}", std::strerror(errno)));
  }
  parts_->listener = std::thread([this] {
    parts_->server.listen_after_bind();
    parts_->ended = true;
  });
  // Before it runs, stop() wouldn't stop it.
  while (!parts_->server.is_running() && !parts_->ended) std::this_thread::yield();
}

FrameServer::~FrameServer() {
  parts_->camera.stop();
  parts_->server.stop();
  parts_->listener.join();
}

int FrameServer::port() const {
  return parts_->port;
}

double number_of(const Requested& requested, const std::string& name, std::optional<double> otherwise) {
  const auto at = requested.find(name);
  if (at == requested.end()) {
    if (otherwise) return *otherwise;
    fail("{}: is missing", name);
  }
  double value = 0.0;
  const char* end = at->second.data() + at->second.size();
  const auto [stop, error] = std::from_chars(at->second.data(), end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value))
    fail("{}: '{}' isn't a number", name, short_text(at->second));
  return value;
}

double angle_of(const Requested& requested, const std::string& name) {
  constexpr double kMost_deg = 360.0;
  const double value = number_of(requested, name, 0.0);
  if (std::abs(value) > kMost_deg) fail("{}: {:g} isn't allowed; {:g} to {:g} is", name, value, -kMost_deg, kMost_deg);
  return value;
}

int count_of(const Requested& requested, const std::string& name) {
  const double value = number_of(requested, name);
  if (value < 0.0 || value > 2e9 || value != std::floor(value)) {
    fail("{}: {} isn't allowed; a whole number from 0 is", name, value);
  }
  return static_cast<int>(value);
}

void allow_only(const Requested& requested, const std::vector<std::string>& allowed) {
  for (const auto& [name, value] : requested) {
    if (std::find(allowed.begin(), allowed.end(), name) != allowed.end()) continue;
    if (allowed.empty()) fail("{}: isn't known; nothing is to be given here", short_text(name));
    fail("{}: isn't known{}; allowed are: {}", short_text(name), did_you_mean(name, allowed), fmt::join(allowed, ", "));
  }
}

}  // namespace touchstone::apps
