// Videos and addresses, by FFmpeg. OpenCV's videoio stands on it, too, but says neither which frames are damaged nor
// when they were taken as they are read raw, and gives grey and 16 bit as 8 bit colours.

#include "datasets/sources/video_reader.h"

#include "datasets/sources/ffmpeg_words.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

namespace touchstone {
namespace {

// Files may name others, on this machine or another (playlists, lists of parts): only what holds its frames is read.
constexpr const char* kFormats =
    "avi,mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,mpeg,mpegts,mpegvideo,m4v,h264,hevc,ivf,nut,flv,asf,ogg,dv,mxf,gif,"
    "yuv4mpegpipe,mjpeg,mpjpeg,rtsp,rtp,sdp";
constexpr const char* kFilesOnly = "file";
constexpr const char* kNetworkOnly = "http,https,tcp,tls,udp,rtp,rtsp,srtp,crypto";
constexpr std::int64_t kMostPixels = 100'000'000;
constexpr AVRational kMicroseconds = {1, 1'000'000};

class Video : public VideoInput {
 public:
  Video(bool address, const VideoPatience& patience) : address_(address), patience_(patience) {}
  ~Video() override {
    const FfmpegListener listener;
    sws_freeContext(scaler_);
    av_frame_free(&picture_);
    av_packet_free(&packet_);
    avcodec_free_context(&decoder_);
    avformat_close_input(&format_);
  }

  bool open(const std::string& place, TouchstoneVideoInfo& info, std::string& message);
  int read(TouchstoneVideoFrame& frame, std::string& message) override;

 private:
  using Clock = std::chrono::steady_clock;

  static int gives_up(void* self) {
    const auto* video = static_cast<const Video*>(self);
    return video->patience_.ended() || (video->address_ && Clock::now() > video->deadline_) ? 1 : 0;
  }
  void wait_anew() { deadline_ = Clock::now() + std::chrono::microseconds(std::llround(patience_.timeout_s * 1e6)); }
  std::string nothing_came() const {
    char text[64];
    std::snprintf(text, sizeof text, "nothing came for %g s", patience_.timeout_s);
    return text;
  }
  bool open_decoder(std::string& message);
  /// Sends the decoder its next packet, or the end. False at the stream's end.
  bool feed(std::string& message);
  int give(TouchstoneVideoFrame& frame);
  int give_fault(TouchstoneVideoFrame& frame, const std::string& why);
  int end(TouchstoneVideoFrame& frame, std::string& message);
  bool ends_early() const;
  bool convert();
  void set_time(std::int64_t timestamp, TouchstoneVideoFrame& frame);

  const bool address_;
  const VideoPatience patience_;
  Clock::time_point deadline_;
  AVFormatContext* format_ = nullptr;
  AVStream* stream_ = nullptr;
  AVCodecContext* decoder_ = nullptr;
  AVPacket* packet_ = nullptr;
  AVFrame* picture_ = nullptr;
  SwsContext* scaler_ = nullptr;
  std::vector<std::uint8_t> pixels_;
  TouchstoneVideoFrame shown_ = {};
  std::string fault_, send_fault_;
  std::int64_t start_ = AV_NOPTS_VALUE;
  std::int64_t packets_ = 0, packet_time_ = AV_NOPTS_VALUE, last_end_ = 0;
  bool intra_only_ = true, spoilt_ = false, drained_ = false, ended_ = false, cut_ = false;
  int turned_deg_ = 0;
};

bool Video::open_decoder(std::string& message) {
  const AVCodec* codec = nullptr;
  const int index = av_find_best_stream(format_, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
  if (index < 0 || (format_->streams[index]->disposition & AV_DISPOSITION_ATTACHED_PIC) != 0) {
    message = index == AVERROR_DECODER_NOT_FOUND ? "its frames are packed in a way that isn't known here"
                                                 : "there are no moving pictures in it";
    return false;
  }
  stream_ = format_->streams[index];
  decoder_ = avcodec_alloc_context3(codec);
  avcodec_parameters_to_context(decoder_, stream_->codecpar);
  decoder_->pkt_timebase = stream_->time_base;
  decoder_->thread_count = 1;  // so that what goes wrong is known to be of the packet that was sent
  decoder_->err_recognition = AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER | AV_EF_EXPLODE;
  decoder_->max_pixels = kMostPixels;
  if (const int error = avcodec_open2(decoder_, codec, nullptr); error < 0) {
    message = ffmpeg_words(error);
    return false;
  }
  const AVCodecDescriptor* const known = avcodec_descriptor_get(decoder_->codec_id);
  intra_only_ = known != nullptr && (known->props & AV_CODEC_PROP_INTRA_ONLY) != 0;
  if (const auto* matrix =
          reinterpret_cast<const std::int32_t*>(av_stream_get_side_data(stream_, AV_PKT_DATA_DISPLAYMATRIX, nullptr))) {
    const double turn = -av_display_rotation_get(matrix);
    if (std::isfinite(turn)) turned_deg_ = static_cast<int>(((std::lround(turn / 90.0) % 4 + 4) % 4) * 90);
  }
  packet_ = av_packet_alloc();
  picture_ = av_frame_alloc();
  return true;
}

bool Video::open(const std::string& place, TouchstoneVideoInfo& info, std::string& message) {
  const FfmpegListener listener;
  format_ = avformat_alloc_context();
  format_->interrupt_callback = {&Video::gives_up, this};
  wait_anew();
  AVDictionary* wishes = nullptr;
  av_dict_set(&wishes, "format_whitelist", kFormats, 0);
  av_dict_set(&wishes, "protocol_whitelist", address_ ? kNetworkOnly : kFilesOnly, 0);
  av_dict_set(&wishes, "rtsp_transport", "tcp", 0);
  int error = avformat_open_input(&format_, (address_ ? place : "file:" + place).c_str(), nullptr, &wishes);
  av_dict_free(&wishes);
  // Of a stream of JPEGs all is known; to look at its beginning first would delay its frames.
  const bool known =
      error >= 0 && address_ && format_->nb_streams > 0 && format_->streams[0]->codecpar->codec_id == AV_CODEC_ID_MJPEG;
  if (error >= 0 && !known) error = avformat_find_stream_info(format_, nullptr);
  if (error < 0) {
    const bool waited = address_ && !patience_.ended() && Clock::now() > deadline_;
    message = waited ? nothing_came() : ffmpeg_words(error);
    return false;
  }
  if (!open_decoder(message)) return false;
  start_ = stream_->start_time;
  const AVRational rate = av_guess_frame_rate(format_, stream_, nullptr);
  info.frames = std::max<std::int64_t>(0, stream_->nb_frames);
  info.duration_s = format_->duration > 0 ? static_cast<double>(format_->duration) / AV_TIME_BASE : 0.0;
  info.frame_rate_Hz = rate.num > 0 && rate.den > 0 ? av_q2d(rate) : 0.0;
  return true;
}

bool Video::feed(std::string& message) {
  for (;;) {
    av_packet_unref(packet_);
    wait_anew();
    const int error = av_read_frame(format_, packet_);
    if (error == AVERROR(EAGAIN) && gives_up(this) == 0) continue;
    if (error < 0) {
      if (patience_.ended()) return false;
      if (address_) {
        message = Clock::now() > deadline_                        ? nothing_came()
                  : error == AVERROR_EOF || error == AVERROR(EIO) ? "the stream ended"
                                                                  : ffmpeg_words(error);
        return false;
      }
      cut_ = error != AVERROR_EOF || !ffmpeg_said().empty();
      drained_ = true;
      avcodec_send_packet(decoder_, nullptr);
      return true;
    }
    if (packet_->stream_index != stream_->index) continue;
    ++packets_;
    if (packet_->size == 0) continue;  // an AVI's note that a frame was dropped
    packet_time_ = packet_->pts != AV_NOPTS_VALUE ? packet_->pts : packet_->dts;
    if (packet_time_ != AV_NOPTS_VALUE) last_end_ = std::max(last_end_, packet_time_ + packet_->duration);
    if ((packet_->flags & AV_PKT_FLAG_CORRUPT) != 0) send_fault_ = "is cut off";
    const int sent = avcodec_send_packet(decoder_, packet_);
    if (sent < 0) send_fault_ = "is damaged (" + ffmpeg_words(sent) + ")";
    return true;
  }
}

int Video::read(TouchstoneVideoFrame& frame, std::string& message) {
  if (ended_) return 0;
  const FfmpegListener listener;
  for (;;) {
    const int got = avcodec_receive_frame(decoder_, picture_);
    if (got == 0) {
      if (send_fault_.empty() && !ffmpeg_said().empty()) send_fault_ = "is damaged (" + ffmpeg_said() + ")";
      return give(frame);
    }
    if (got == AVERROR_EOF) return end(frame, message);
    if (got != AVERROR(EAGAIN) && send_fault_.empty()) send_fault_ = "is damaged (" + ffmpeg_words(got) + ")";
    if (!send_fault_.empty() && !drained_) {
      spoilt_ = !intra_only_;
      set_time(packet_time_, frame);
      return give_fault(frame, std::exchange(send_fault_, ""));
    }
    if (!feed(message)) return end(frame, message);
  }
}

int Video::end(TouchstoneVideoFrame& frame, std::string& message) {
  ended_ = true;
  if (patience_.ended()) return 0;
  if (address_) return message.empty() ? 0 : -1;
  if (!cut_ && !ends_early()) return 0;
  frame.timed = 0;
  return give_fault(frame,
                    stream_->nb_frames > 0
                        ? "isn't there: the file ends within the video, after " + std::to_string(packets_) + " of " +
                              std::to_string(stream_->nb_frames) + " frames"
                        : "isn't there: the file ends within the video, after " + std::to_string(packets_) + " frames");
}

bool Video::ends_early() const {
  // Some writers count a frame too many.
  if (stream_->nb_frames > 0) return packets_ < stream_->nb_frames - 1;
  if (format_->duration <= 0 || packets_ == 0) return false;
  // The duration is that of the longest stream.
  const double says_s = static_cast<double>(format_->duration) / AV_TIME_BASE;
  const std::int64_t start = stream_->start_time == AV_NOPTS_VALUE ? 0 : stream_->start_time;
  const double has_s = static_cast<double>(last_end_ - start) * av_q2d(stream_->time_base);
  const double frame_s = has_s / static_cast<double>(packets_);
  return says_s - has_s > std::max(2.5 * frame_s, format_->nb_streams > 1 ? 0.05 * says_s : 0.0);
}

void Video::set_time(std::int64_t timestamp, TouchstoneVideoFrame& frame) {
  frame.timed = timestamp != AV_NOPTS_VALUE ? 1 : 0;
  if (frame.timed == 0) return;
  if (start_ == AV_NOPTS_VALUE) start_ = timestamp;
  frame.t_us = av_rescale_q(timestamp - start_, stream_->time_base, kMicroseconds);
}

int Video::give_fault(TouchstoneVideoFrame& frame, const std::string& why) {
  fault_ = why;
  frame.pixels = nullptr;
  frame.fault = fault_.c_str();
  return 1;
}

int Video::give(TouchstoneVideoFrame& frame) {
  set_time(picture_->best_effort_timestamp, frame);
  std::string why = std::exchange(send_fault_, "");
  if (why.empty() && ((picture_->flags & AV_FRAME_FLAG_CORRUPT) != 0 || picture_->decode_error_flags != 0)) {
    why = "is damaged";
  }
  if (!why.empty()) {
    spoilt_ = !intra_only_;
    return give_fault(frame, why);
  }
  // What follows a damaged frame is drawn over it, up to the next one that stands alone.
  if (picture_->key_frame != 0) spoilt_ = false;
  if (spoilt_) return give_fault(frame, "is drawn over a damaged frame before it");
  if (!convert()) return give_fault(frame, "can't be turned into a picture");
  const int timed = frame.timed;
  const long long t_us = frame.t_us;
  frame = shown_;
  frame.timed = timed;
  frame.t_us = t_us;
  return 1;
}

bool Video::convert() {
  const auto format = static_cast<AVPixelFormat>(picture_->format);
  const AVPixFmtDescriptor* const known = av_pix_fmt_desc_get(format);
  if (known == nullptr || picture_->width < 1 || picture_->height < 1) return false;
  const bool deep = known->comp[0].depth > 8;
  const bool coloured = known->nb_components > 2 || (known->flags & (AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BAYER)) != 0;
  const AVPixelFormat wanted =
      coloured ? (deep ? AV_PIX_FMT_BGR48LE : AV_PIX_FMT_BGR24) : (deep ? AV_PIX_FMT_GRAY16LE : AV_PIX_FMT_GRAY8);
  shown_ = {.pixels = picture_->data[0],
            .row_bytes = static_cast<std::size_t>(std::max(0, picture_->linesize[0])),
            .width = picture_->width,
            .height = picture_->height,
            .channels = coloured ? 3 : 1,
            .bits = deep ? 16 : 8,
            .turned_deg = turned_deg_,
            .timed = 0,
            .t_us = 0,
            .fault = nullptr};
  if (format == wanted && picture_->linesize[0] > 0) return true;
  scaler_ = sws_getCachedContext(scaler_, picture_->width, picture_->height, format, picture_->width, picture_->height,
                                 wanted, SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT | SWS_FULL_CHR_H_INP,
                                 nullptr, nullptr, nullptr);
  if (scaler_ == nullptr) return false;
  const bool full = !coloured || (known->flags & AV_PIX_FMT_FLAG_RGB) != 0 ||
                    picture_->color_range == AVCOL_RANGE_JPEG || format == AV_PIX_FMT_YUVJ420P ||
                    format == AV_PIX_FMT_YUVJ422P || format == AV_PIX_FMT_YUVJ444P || format == AV_PIX_FMT_YUVJ440P;
  // Its numbers for colour spaces are FFmpeg's own, but for those that it doesn't know.
  const int* const from = sws_getCoefficients(picture_->colorspace);
  sws_setColorspaceDetails(scaler_, from, full ? 1 : 0, sws_getCoefficients(SWS_CS_DEFAULT), 1, 0, 1 << 16, 1 << 16);
  const std::size_t item = static_cast<std::size_t>(shown_.channels) * (deep ? 2 : 1);
  shown_.row_bytes = (static_cast<std::size_t>(picture_->width) * item + 63) / 64 * 64;  // it writes whole vectors
  pixels_.resize(shown_.row_bytes * static_cast<std::size_t>(picture_->height) + 64);
  std::uint8_t* const rows[4] = {pixels_.data(), nullptr, nullptr, nullptr};
  const int steps[4] = {static_cast<int>(shown_.row_bytes), 0, 0, 0};
  shown_.pixels = pixels_.data();
  return sws_scale(scaler_, picture_->data, picture_->linesize, 0, picture_->height, rows, steps) == picture_->height;
}

}  // namespace

std::unique_ptr<VideoInput> open_video(const std::string& place, bool address, const VideoPatience& patience,
                                       TouchstoneVideoInfo& info, std::string& message) {
  static const bool begun = [] {
    avformat_network_init();
    return true;
  }();
  static_cast<void>(begun);
  auto video = std::make_unique<Video>(address, patience);
  if (!video->open(place, info, message)) return nullptr;
  return video;
}

}  // namespace touchstone
