#include "datasets/sources/video_module.h"

#include <cstdio>
#include <exception>

#include "datasets/sources/video_reader.h"

namespace {

void tell(const std::string& why, char* message, std::size_t size) {
  std::snprintf(message, size, "%s", why.c_str());
  for (char* c = message; *c != '\0'; ++c) {
    if (*c == '\n' || *c == '\r') *c = ' ';
  }
}

// No exception may cross the border.
void* guarded_open(const char* place, TouchstoneVideoKind kind, double timeout_s, int (*gives_up)(void*), void* context,
                   TouchstoneVideoInfo* info, char* message, std::size_t size) {
  std::string why;
  try {
    const touchstone::VideoPatience patience{timeout_s, gives_up, context};
    auto video = kind == kTouchstoneCamera
                     ? touchstone::open_camera(place, patience, *info, why)
                     : touchstone::open_video(place, kind == kTouchstoneVideoAddress, patience, *info, why);
    if (video) return video.release();
  } catch (const std::exception& error) {
    why = error.what();
  }
  tell(why, message, size);
  return nullptr;
}

int guarded_read(void* video, TouchstoneVideoFrame* frame, char* message, std::size_t size) {
  std::string why;
  try {
    const int got = static_cast<touchstone::VideoInput*>(video)->read(*frame, why);
    if (got >= 0) return got;
  } catch (const std::exception& error) {
    why = error.what();
  }
  tell(why, message, size);
  return -1;
}

void close(void* video) {
  delete static_cast<touchstone::VideoInput*>(video);
}

constexpr TouchstoneVideoModule kTable = {
    .version = kTouchstoneVideoModuleVersion, .open = guarded_open, .read = guarded_read, .close = close};

}  // namespace

extern "C" __attribute__((visibility("default"))) const void* touchstone_video_module_table() {
  return &kTable;
}
