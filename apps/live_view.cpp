#include "apps/live_view.h"

#include <fmt/format.h>
#include <httplib.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "apps/jpeg_answers.h"
#include "apps/listening_server.h"
#include "plots/line_plot.h"
#include "render/imager/jpeg.h"

namespace touchstone::apps {
namespace {

constexpr int kMostWatching = 6;
constexpr int kThreads = 8;
constexpr double kPatience_s = 10.0;
constexpr int kQuality = 85;
constexpr const char* kAddress = "127.0.0.1";

std::string live_page(const std::string& title) {
  const std::string name = plots::escape_markup(title);
  return "<!DOCTYPE html><html lang=\"en\"><meta charset=\"utf-8\"><title>" + name + "</title><h1>" + name +
         "</h1><p><img src=\"/stream.mjpg\" alt=\"each frame with what is estimated of it\"></p></html>\n";
}

}  // namespace

struct LiveView::Parts {
  explicit Parts(std::string what) : title(std::move(what)), server(kThreads, kPatience_s) {}

  /// The picture after number `after`, once there is one; null at the end.
  std::shared_ptr<const NumberedJpeg> next(std::int64_t after) {
    cv::Mat picture;
    std::int64_t number = 0;
    {
      std::unique_lock<std::mutex> lock(mutex);
      shown.wait(lock, [&] { return ended || count > after; });
      if (ended || last.empty()) return nullptr;
      picture = last;
      number = count;
    }
    const std::lock_guard<std::mutex> making(making_one);
    if (made && made->number == number) return made;
    auto one = std::make_shared<NumberedJpeg>();
    one->number = number;
    one->jpeg = render::jpeg_bytes(picture, {.quality = kQuality});
    made = one;
    return one;
  }

  void answer(const httplib::Request& request, httplib::Response& response) {
    if (request.path == "/") return response.set_content(live_page(title), "text/html");
    if (request.path == "/frame.jpg") {
      const auto picture = next(-1);
      return picture ? answer_jpeg(response, *picture) : answer_error(response, 503, "the estimate has ended");
    }
    if (++watching > kMostWatching) {
      --watching;
      return answer_error(response, 503, fmt::format("{} clients are served; no more are", kMostWatching));
    }
    answer_jpegs(
        response, [this](std::int64_t after) { return next(after); }, [this] { --watching; });
  }

  const std::string title;
  ListeningServer server;
  std::mutex mutex;
  std::condition_variable shown;
  cv::Mat last;  // not changed any more: the next one has memory of its own
  std::int64_t count = -1;
  bool ended = false;
  std::atomic<int> watching{0};
  std::mutex making_one;  // one thread encodes, the others wait for it
  std::shared_ptr<const NumberedJpeg> made;
};

LiveView::LiveView(std::string title, int port) : parts_(std::make_unique<Parts>(std::move(title))) {
  Parts* const parts = parts_.get();
  parts->server.set_socket_options(&ListeningServer::keep_port);
  parts->server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
    using Handled = httplib::Server::HandlerResponse;
    return request_may_go_on(request, response, {}) ? Handled::Unhandled : Handled::Handled;
  });
  for (const char* path : {"/", "/frame.jpg", "/stream.mjpg"}) {
    parts->server.Get(path, [parts](const auto& request, auto& response) { parts->answer(request, response); });
  }
  parts->server.set_error_handler([](const httplib::Request&, httplib::Response& response) {
    if (response.body.empty()) {
      answer_error(response, response.status, "there are only /, /frame.jpg and /stream.mjpg");
    }
  });
  parts->server.begin(kAddress, port, {"--live: ", "another port may be free, 0 takes any"});
}

LiveView::~LiveView() {
  {
    const std::lock_guard<std::mutex> lock(parts_->mutex);
    parts_->ended = true;
  }
  parts_->shown.notify_all();
  parts_->server.end();
}

int LiveView::port() const {
  return parts_->server.port();
}

void LiveView::show(const cv::Mat& picture) {
  cv::Mat own;
  if (picture.depth() == CV_16U) {
    picture.convertTo(own, CV_8U, 1.0 / 257.0);
  } else {
    own = picture.clone();
  }
  {
    const std::lock_guard<std::mutex> lock(parts_->mutex);
    parts_->last = own;
    ++parts_->count;
  }
  parts_->shown.notify_all();
}

}  // namespace touchstone::apps
