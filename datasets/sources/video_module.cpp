#include "datasets/sources/video_module.h"

#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "datasets/sources/video_reader.h"
#include "datasets/sources/video_writer.h"

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

/// 0 if `act()` says that nothing went wrong.
template <typename Act>
int guarded(const Act& act, char* message, std::size_t size) {
  std::string why;
  try {
    why = act();
    if (why.empty()) return 0;
  } catch (const std::exception& error) {
    why = error.what();
  }
  tell(why, message, size);
  return -1;
}

void* guarded_create(const char* file, int width, int height, char* message, std::size_t size) {
  std::unique_ptr<touchstone::VideoOutput> video;
  const auto open = [&] {
    video = std::make_unique<touchstone::VideoOutput>();
    return video->open(file, width, height);
  };
  return guarded(open, message, size) == 0 ? video.release() : nullptr;
}

int guarded_add(void* video, const unsigned char* pixels, std::size_t row_bytes, long long t_us, char* message,
                std::size_t size) {
  return guarded([&] { return static_cast<touchstone::VideoOutput*>(video)->add(pixels, row_bytes, t_us); }, message,
                 size);
}

int guarded_finish(void* video, char* message, std::size_t size) {
  return guarded([&] { return static_cast<touchstone::VideoOutput*>(video)->finish(); }, message, size);
}

void drop(void* video) {
  delete static_cast<touchstone::VideoOutput*>(video);
}

constexpr TouchstoneVideoModule kTable = {.version = kTouchstoneVideoModuleVersion,
                                          .open = guarded_open,
                                          .read = guarded_read,
                                          .close = close,
                                          .create = guarded_create,
                                          .add = guarded_add,
                                          .finish = guarded_finish,
                                          .drop = drop};

}  // namespace

extern "C" __attribute__((visibility("default"))) const void* touchstone_video_module_table() {
  return &kTable;
}
