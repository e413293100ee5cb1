// Videos that players and browsers show: H.264, or where FFmpeg is built without it MPEG-4, in MP4.

#include "datasets/sources/video_writer.h"

#include "datasets/sources/ffmpeg_words.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cmath>

namespace touchstone {
namespace {

constexpr AVRational kClock = {1, 90'000};
constexpr AVRational kMicroseconds = {1, 1'000'000};
constexpr std::int64_t kUsualDuration_us = 40'000;
constexpr const char* kConstantQuality = "20";  // x264's crf: no step is seen by eye

}  // namespace

struct VideoOutput::Parts {
  AVFormatContext* format = nullptr;
  AVStream* stream = nullptr;
  AVCodecContext* encoder = nullptr;
  AVPacket* packet = nullptr;
  AVFrame* picture = nullptr;
  SwsContext* scaler = nullptr;
  std::int64_t last = -1;
  int width = 0, height = 0;

  ~Parts() {
    const FfmpegListener listener;  // encoders sum up what they did
    sws_freeContext(scaler);
    av_frame_free(&picture);
    av_packet_free(&packet);
    avcodec_free_context(&encoder);
    if (format != nullptr) avio_closep(&format->pb);
    avformat_free_context(format);
  }

  /// Writes what the encoder has ready; null as `from`: to the end.
  int encode(const AVFrame* from) {
    int code = avcodec_send_frame(encoder, from);
    while (code >= 0) {
      code = avcodec_receive_packet(encoder, packet);
      if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) return 0;
      if (code < 0) break;
      // Without it the last picture lasts no time, and readers leave it out.
      if (packet->duration <= 0) packet->duration = av_rescale_q(kUsualDuration_us, kMicroseconds, encoder->time_base);
      av_packet_rescale_ts(packet, encoder->time_base, stream->time_base);
      packet->stream_index = stream->index;
      code = av_interleaved_write_frame(format, packet);
    }
    return code;
  }
};

VideoOutput::VideoOutput() : parts_(std::make_unique<Parts>()) {}
VideoOutput::~VideoOutput() = default;

std::string VideoOutput::open(const std::string& file, int width, int height) {
  const FfmpegListener listener;
  Parts& p = *parts_;
  // Encoders take pairs of rows and columns: of an odd size the last one is left out.
  p.width = std::max(2, width - width % 2);
  p.height = std::max(2, height - height % 2);
  int code = avformat_alloc_output_context2(&p.format, nullptr, "mp4", nullptr);
  if (code < 0) return ffmpeg_words(code);
  const AVCodec* codec = avcodec_find_encoder(AV_CODEC_ID_H264);
  const bool mpeg4 = codec == nullptr;
  if (mpeg4) codec = avcodec_find_encoder(AV_CODEC_ID_MPEG4);
  if (codec == nullptr) return "FFmpeg has no encoder of H.264 or MPEG-4";
  p.stream = avformat_new_stream(p.format, codec);
  p.encoder = avcodec_alloc_context3(codec);
  p.packet = av_packet_alloc();
  p.picture = av_frame_alloc();
  if (p.stream == nullptr || p.encoder == nullptr || p.packet == nullptr || p.picture == nullptr) return "no memory";
  p.encoder->width = p.width;
  p.encoder->height = p.height;
  p.encoder->pix_fmt = AV_PIX_FMT_YUV420P;
  p.encoder->time_base = mpeg4 ? AVRational{1, 1000} : kClock;  // MPEG-4's clock has 16 bit
  p.encoder->thread_count = 1;                                  // the same bytes everywhere
  if ((p.format->oformat->flags & AVFMT_GLOBALHEADER) != 0) p.encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (mpeg4) {
    p.encoder->flags |= AV_CODEC_FLAG_QSCALE;
    p.encoder->global_quality = 3 * FF_QP2LAMBDA;
  } else {
    av_opt_set(p.encoder->priv_data, "crf", kConstantQuality, 0);
    av_opt_set(p.encoder->priv_data, "preset", "veryfast", 0);
    // With both, its assembly reads memory that nobody has set: the same pictures made other bytes from time to time.
    av_opt_set(p.encoder->priv_data, "x264-params", "bframes=0:no-mbtree=1", 0);
  }
  code = avcodec_open2(p.encoder, codec, nullptr);
  if (code >= 0) code = avcodec_parameters_from_context(p.stream->codecpar, p.encoder);
  if (code < 0) return ffmpeg_words(code);
  p.stream->time_base = p.encoder->time_base;
  p.picture->format = p.encoder->pix_fmt;
  p.picture->width = p.width;
  p.picture->height = p.height;
  code = av_frame_get_buffer(p.picture, 0);
  p.scaler = sws_getContext(p.width, p.height, AV_PIX_FMT_BGR24, p.width, p.height, AV_PIX_FMT_YUV420P,
                            SWS_BILINEAR | SWS_ACCURATE_RND | SWS_BITEXACT, nullptr, nullptr, nullptr);
  if (code >= 0 && p.scaler == nullptr) return "no memory";
  p.format->flags |= AVFMT_FLAG_BITEXACT;
  if (code >= 0) code = avio_open(&p.format->pb, ("file:" + file).c_str(), AVIO_FLAG_WRITE);
  if (code >= 0) code = avformat_write_header(p.format, nullptr);
  return code < 0 ? ffmpeg_words(code) : "";
}

std::string VideoOutput::add(const unsigned char* bgr, std::size_t row_bytes, std::int64_t t_us) {
  const FfmpegListener listener;
  Parts& p = *parts_;
  int code = av_frame_make_writable(p.picture);
  if (code < 0) return ffmpeg_words(code);
  const int stride = static_cast<int>(row_bytes);
  sws_scale(p.scaler, &bgr, &stride, 0, p.height, p.picture->data, p.picture->linesize);
  p.last = std::max(p.last + 1, av_rescale_q(t_us, kMicroseconds, p.encoder->time_base));
  p.picture->pts = p.last;
  code = p.encode(p.picture);
  return code < 0 ? ffmpeg_words(code) : "";
}

std::string VideoOutput::finish() {
  const FfmpegListener listener;
  Parts& p = *parts_;
  int code = p.encode(nullptr);
  if (code >= 0) code = av_write_trailer(p.format);
  if (code >= 0) code = avio_closep(&p.format->pb);
  return code < 0 ? ffmpeg_words(code) : "";
}

}  // namespace touchstone
