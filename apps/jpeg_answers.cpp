#include "apps/jpeg_answers.h"

#include <fmt/format.h>
#include <httplib.h>

#include <nlohmann/json.hpp>
#include <utility>

namespace touchstone::apps {
namespace {

constexpr const char* kBoundary = "touchstone-frame";
constexpr const char* kFrameHeader = "X-Touchstone-Frame";

}  // namespace

void answer_error(httplib::Response& response, int status, const std::string& message) {
  response.status = status;
  const nlohmann::json json = {{"error", message}};
  response.set_content(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n", "application/json");
}

void answer_jpeg(httplib::Response& response, const NumberedJpeg& picture) {
  response.set_header(kFrameHeader, std::to_string(picture.number));
  response.set_header("Cache-Control", "no-store");
  response.set_content(picture.jpeg, "image/jpeg");
}

void answer_jpegs(httplib::Response& response,
                  std::function<std::shared_ptr<const NumberedJpeg>(std::int64_t after)> next,
                  std::function<void()> done) {
  response.set_header("Cache-Control", "no-store");
  response.set_content_provider(
      fmt::format("multipart/x-mixed-replace; boundary={}", kBoundary),
      [last = std::make_shared<std::int64_t>(-1), next = std::move(next)](std::size_t, httplib::DataSink& sink) {
        const std::shared_ptr<const NumberedJpeg> picture = next(*last);
        if (!picture) return false;
        *last = picture->number;
        const std::string head = fmt::format("--{}\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n{}: {}\r\n\r\n",
                                             kBoundary, picture->jpeg.size(), kFrameHeader, picture->number);
        return sink.write(head.data(), head.size()) && sink.write(picture->jpeg.data(), picture->jpeg.size()) &&
               sink.write("\r\n", 2);
      },
      [done = std::move(done)](bool) { done(); });
}

bool request_may_go_on(const httplib::Request& request, httplib::Response& response, const AllowedSources& sources) {
  const auto refuse = [&](int status, const std::string& message) {
    answer_error(response, status, message);
    return false;
  };
  const std::string host = request.get_header_value("Host");
  if (request.get_header_value_count("Host") > 1 || request.get_header_value_count("Origin") > 1) {
    return refuse(400, "Host and Origin may each stand once in a request");
  }
  if (!host_is_allowed(host, sources)) {
    return refuse(
        421, fmt::format("Host: '{}' isn't answered; an address, localhost and the names given by --host are", host));
  }
  if (request.has_header("Origin")) {
    const std::string origin = request.get_header_value("Origin");
    if (!origin_is_allowed(origin, host, sources)) {
      return refuse(403,
                    fmt::format("Origin: '{}' may not use this server; --allow-origin {} allows it", origin, origin));
    }
    response.set_header("Access-Control-Allow-Origin", origin);
  }
  return true;
}

}  // namespace touchstone::apps
