#pragma once
// The border between the program and its video module, which alone links FFmpeg and OpenCV's videoio and is opened when
// the first video or camera is. Plain C types only: the two sides share no C++ objects. Internal to datasets.

#include <cstddef>

extern "C" {

/// What is opened.
enum TouchstoneVideoKind { kTouchstoneVideoFile = 0, kTouchstoneVideoAddress = 1, kTouchstoneCamera = 2 };

/// What a video says of itself.
struct TouchstoneVideoInfo {
  long long frames;      // 0: it doesn't say
  double duration_s;     // likewise
  double frame_rate_Hz;  // likewise
};

/// A frame; its pixels are good until the next call.
struct TouchstoneVideoFrame {
  const void* pixels;  // rows top down, grey or BGR; null: there is none, and `fault` says why
  std::size_t row_bytes;
  int width, height, channels, bits;
  int turned_deg;  // how far a player turns it clockwise: 0, 90, 180, 270
  int timed;       // 1: t_us is known
  long long t_us;  // by the video's own clock
  const char* fault;
};

/// The functions of the module, found by kTouchstoneVideoModuleSymbol.
struct TouchstoneVideoModule {
  int version;
  /// `place`: a file's path, an address, or a camera's number. Null if it can't be opened: `message` says why. Waits
  /// for an address or a camera at most `timeout_s`, and as long at most for each of its frames; in between it asks
  /// `gives_up(context)`, and ends if that isn't 0.
  void* (*open)(const char* place, TouchstoneVideoKind kind, double timeout_s, int (*gives_up)(void* context),
                void* context, TouchstoneVideoInfo* info, char* message, std::size_t message_size);
  /// 1: a frame, or a fault of one; 0: the end; -1: it can't go on, and `message` says why.
  int (*read)(void* video, TouchstoneVideoFrame* frame, char* message, std::size_t message_size);
  void (*close)(void* video);

  /// A new video of H.264 in MP4, whatever the file's name. Null if it can't be written: `message` says why.
  void* (*create)(const char* file, int width, int height, char* message, std::size_t message_size);
  /// Adds a picture, BGR of that size, that is shown from `t_us` on; of an odd size the last row or column is left out.
  /// Not 0: it can't be, and `message` says why.
  int (*add)(void* video, const unsigned char* pixels, std::size_t row_bytes, long long t_us, char* message,
             std::size_t message_size);
  /// Brings all to the file. Not 0: it can't, and `message` says why.
  int (*finish)(void* video, char* message, std::size_t message_size);
  /// Ends what create() began, finished or not.
  void (*drop)(void* video);
};

constexpr int kTouchstoneVideoModuleVersion = 2;  ///< changes with any of these structs
constexpr const char* kTouchstoneVideoModuleSymbol =
    "touchstone_video_module_table";  ///< the module's function that returns its table
}
