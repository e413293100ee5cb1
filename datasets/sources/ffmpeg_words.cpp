#include "datasets/sources/ffmpeg_words.h"

extern "C" {
#include <libavutil/error.h>
#include <libavutil/log.h>
}

#include <cstdarg>
#include <cstdio>

namespace touchstone {
namespace {

thread_local bool listening = false;
thread_local std::string last_words;

void note_log(void* context, int level, const char* format, std::va_list args) {
  if (!listening) return av_log_default_callback(context, level, format, args);
  if (level > AV_LOG_ERROR) return;
  char line[512];
  std::vsnprintf(line, sizeof line, format, args);
  last_words = line;
  while (!last_words.empty() && (last_words.back() == '\n' || last_words.back() == ' ')) last_words.pop_back();
}

}  // namespace

FfmpegListener::FfmpegListener() {
  static const bool heard = [] {
    av_log_set_callback(&note_log);
    return true;
  }();
  static_cast<void>(heard);
  listening = true;
  last_words.clear();
}

FfmpegListener::~FfmpegListener() {
  listening = false;
}

const std::string& ffmpeg_said() {
  return last_words;
}

std::string ffmpeg_words(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, text, sizeof text);
  return last_words.empty() ? std::string(text) : last_words;
}

}  // namespace touchstone
