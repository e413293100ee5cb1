#pragma once
// What servers of pictures answer with: streams of JPEGs as network cameras send them, and mistakes as JSON.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "apps/request_source.h"

namespace httplib {
struct Request;
struct Response;
}  // namespace httplib

namespace touchstone::apps {

/// A picture of a stream, encoded.
struct NumberedJpeg {
  std::int64_t number = 0;
  std::string jpeg;
};

/// {"error": "..."}
void answer_error(httplib::Response& response, int status, const std::string& message);

/// One picture, with its number as the header X-Touchstone-Frame.
void answer_jpeg(httplib::Response& response, const NumberedJpeg& picture);

/// multipart/x-mixed-replace without an end.
/// @param next the picture after number `after` (-1: any); null ends the stream @param done when it has ended
void answer_jpegs(httplib::Response& response,
                  std::function<std::shared_ptr<const NumberedJpeg>(std::int64_t after)> next,
                  std::function<void()> done);

/// Answers a request whose Host isn't for this server or whose Origin may not use it, and allows the others' Origin.
/// @returns whether the request may go on
bool request_may_go_on(const httplib::Request& request, httplib::Response& response, const AllowedSources& sources);

}  // namespace touchstone::apps
