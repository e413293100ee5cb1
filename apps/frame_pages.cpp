#include "apps/frame_pages.h"

#include <fmt/ranges.h>
#include <httplib.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "apps/jpeg_answers.h"
#include "core/error.h"
#include "core/nearest_name.h"
#include "core/short_text.h"
#include "plots/line_plot.h"

namespace touchstone::apps {
namespace {

constexpr int kMostStreams = 24;
constexpr int kMostCommands = 8;  // at once; a press takes seconds, and the next one waits for it
constexpr const char* kForm = "application/x-www-form-urlencoded";
constexpr std::array<std::string_view, 5> kPages = {"/", "/frame.jpg", "/status.json", "/stream.mjpg", "/truth.json"};

std::string page(const std::string& title) {
  const std::string name = plots::escape_markup(title);
  return "<!DOCTYPE html><html lang=\"en\"><meta charset=\"utf-8\"><title>" + name + "</title><h1>" + name +
         "</h1><p><img src=\"/stream.mjpg\" alt=\"what the camera shows\"></p><p><a href=\"/frame.jpg\">one frame</a>, "
         "<a href=\"/status.json\">its truth</a></p></html>\n";
}

/// Counts what is done at once.
class Share {
 public:
  Share(std::atomic<int>& count, int most) : count_(&count) {
    if (++count > most) release();
  }
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;
  ~Share() { release(); }
  bool had() const { return count_ != nullptr; }

 private:
  void release() {
    if (count_ != nullptr) --*count_;
    count_ = nullptr;
  }
  std::atomic<int>* count_;
};

}  // namespace

struct FramePages::Parts {
  Parts(ServedCamera& shown, Contents answered) : camera(shown), contents(std::move(answered)) {}

  /// Answers what isn't for this server. @returns whether the request may go on
  bool check_request(const httplib::Request& request, httplib::Response& response) const {
    const auto refuse = [&](int status, const std::string& message) {
      answer_error(response, status, message);
      return false;
    };
    if (!request_may_go_on(request, response, contents.sources)) return false;
    const std::string host = request.get_header_value("Host");
    const bool is_command = contents.commands.contains(request.path);
    if (!is_command && std::find(kPages.begin(), kPages.end(), request.path) == kPages.end()) {
      std::vector<std::string> all(kPages.begin(), kPages.end());
      for (const auto& [path, ignored] : contents.commands) all.push_back(path);
      return refuse(404, fmt::format("there is no {}; there are: {}", request.path, fmt::join(all, ", ")));
    }
    const bool fits = is_command ? request.method == "POST" : request.method == "GET" || request.method == "HEAD";
    if (!fits) {
      response.set_header("Allow", is_command ? "POST" : "GET, HEAD");
      return refuse(
          405, is_command ? fmt::format("{} wants POST, not {}: curl -d '{}' http://{}{}", request.path, request.method,
                                        contents.commands.at(request.path).example, host, request.path)
                          : fmt::format("{} wants GET, not {}", request.path, request.method));
    }
    const std::string type = request.get_header_value("Content-Type");
    if (request.get_header_value("Content-Length") != "0" && !type.starts_with(kForm)) {
      return refuse(415, fmt::format("Content-Type: '{}' isn't taken; a body has to be {}", type, kForm));
    }
    return true;
  }

  void one(httplib::Response& response) {
    const auto frame = camera.latest();
    if (!frame) return answer_error(response, 503, "the camera is being stopped");
    answer_jpeg(response, *frame);
  }

  void stream(httplib::Response& response) {
    if (++streams > kMostStreams) {
      --streams;
      return answer_error(response, 503, fmt::format("{} clients are served; no more are", kMostStreams));
    }
    answer_jpegs(
        response,
        [this](std::int64_t after) -> std::shared_ptr<const NumberedJpeg> {
          return after < 0 ? camera.latest() : camera.next(after);
        },
        [this] { --streams; });
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

  void carry_out(const Command& command, const httplib::Request& request, httplib::Response& response) {
    const Share share(running, kMostCommands);
    if (!share.had()) {
      return answer_error(response, 503, fmt::format("{} commands are being carried out; no more are", kMostCommands));
    }
    try {
      const Requested values = values_of(request);
      if (values.empty() && !command.example.empty()) {
        fail("nothing is asked for; for example, as a body or after '?': {}", command.example);
      }
      command.carry_out(values);
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
  Contents contents;
  std::atomic<int> streams{0};
  std::atomic<int> running{0};
};

FramePages::FramePages(ServedCamera& camera, Contents contents)
    : parts_(std::make_unique<Parts>(camera, std::move(contents))) {}

FramePages::~FramePages() = default;

void FramePages::add_to(httplib::Server& server) {
  using Handled = httplib::Server::HandlerResponse;
  Parts* const parts = parts_.get();
  server.set_pre_routing_handler([parts](const auto& request, auto& response) {
    return parts->check_request(request, response) ? Handled::Unhandled : Handled::Handled;
  });
  server.set_error_handler([](const httplib::Request&, httplib::Response& response) {
    // What httplib refuses itself it says nothing about.
    if (response.body.empty()) answer_error(response, response.status, "the request can't be read");
  });
  server.Get("/",
             [parts](const auto&, auto& response) { response.set_content(page(parts->contents.title), "text/html"); });
  server.Get("/frame.jpg", [parts](const auto&, auto& response) { parts->one(response); });
  server.Get("/stream.mjpg", [parts](const auto&, auto& response) { parts->stream(response); });
  server.Get("/status.json", [parts](const auto&, auto& response) { parts->status(response); });
  server.Get("/truth.json", [parts](const auto& request, auto& response) { parts->truth(request, response); });
  for (const auto& [path, command] : parts->contents.commands) {
    server.Post(path, [parts, &command = command](const auto& request, auto& response) {
      parts->carry_out(command, request, response);
    });
  }
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
