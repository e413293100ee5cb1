#include "tests/support/written_video.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include "core/error.h"

namespace touchstone::test {
namespace {

void need(bool done, const char* what) {
  if (!done) fail("a video for a test: {} failed", what);
}

AVPixelFormat format_of(const cv::Mat& picture) {
  if (picture.type() == CV_16UC1) return AV_PIX_FMT_GRAY16LE;
  return picture.type() == CV_8UC1 ? AV_PIX_FMT_GRAY8 : AV_PIX_FMT_BGR24;
}

}  // namespace

void write_video(const std::filesystem::path& file, const std::vector<cv::Mat>& frames, const VideoToWrite& how) {
  AVFormatContext* format = nullptr;
  need(avformat_alloc_output_context2(&format, nullptr, nullptr, file.c_str()) >= 0, "its container");
  const AVCodec* const codec = avcodec_find_encoder_by_name(how.codec.c_str());
  need(codec != nullptr, how.codec.c_str());
  AVCodecContext* encoder = avcodec_alloc_context3(codec);
  AVStream* const stream = avformat_new_stream(format, nullptr);
  encoder->width = frames.front().cols;
  encoder->height = frames.front().rows;
  encoder->pix_fmt = av_get_pix_fmt(how.pixels.c_str());
  encoder->time_base = stream->time_base = {1, 1000};
  if (how.t_ms.empty()) encoder->time_base = stream->time_base = {1, 25};
  encoder->framerate = {25, 1};
  encoder->gop_size = how.key_every;
  encoder->max_b_frames = 0;
  encoder->thread_count = 1;
  encoder->bit_rate = 4'000'000;
  encoder->strict_std_compliance = FF_COMPLIANCE_UNOFFICIAL;
  if (how.codec == "ffv1") {  // with checksums
    encoder->level = 3;
    av_opt_set_int(encoder->priv_data, "slicecrc", 1, 0);
  }
  if ((format->oformat->flags & AVFMT_GLOBALHEADER) != 0) encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  need(avcodec_open2(encoder, codec, nullptr) >= 0, "its encoder");
  avcodec_parameters_from_context(stream->codecpar, encoder);
  if (how.turned_deg != 0) {
    auto* const matrix = reinterpret_cast<std::int32_t*>(
        av_stream_new_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, 9 * sizeof(std::int32_t)));
    av_display_rotation_set(matrix, how.turned_deg);
  }
  need(avio_open(&format->pb, file.c_str(), AVIO_FLAG_WRITE) >= 0, "opening it");
  need(avformat_write_header(format, nullptr) >= 0, "its header");
  AVFrame* picture = av_frame_alloc();
  AVPacket* packet = av_packet_alloc();
  const auto send = [&](const AVFrame* frame) {
    need(avcodec_send_frame(encoder, frame) >= 0, "a frame");
    while (avcodec_receive_packet(encoder, packet) >= 0) {
      packet->duration = how.t_ms.empty() ? 1 : 40;
      packet->stream_index = stream->index;
      av_packet_rescale_ts(packet, encoder->time_base, stream->time_base);
      need(av_interleaved_write_frame(format, packet) >= 0, "writing a frame");
    }
  };
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const cv::Mat& from = frames[i];
    picture->format = encoder->pix_fmt;
    picture->width = encoder->width;
    picture->height = encoder->height;
    need(av_frame_get_buffer(picture, 0) >= 0, "memory");
    SwsContext* const scaler =
        sws_getContext(from.cols, from.rows, format_of(from), from.cols, from.rows, encoder->pix_fmt,
                       SWS_BICUBIC | SWS_ACCURATE_RND, nullptr, nullptr, nullptr);
    need(scaler != nullptr, "a change of pixels");
    const std::uint8_t* const rows[4] = {from.data, nullptr, nullptr, nullptr};
    const int steps[4] = {static_cast<int>(from.step[0]), 0, 0, 0};
    sws_scale(scaler, rows, steps, 0, from.rows, picture->data, picture->linesize);
    sws_freeContext(scaler);
    picture->pts = how.t_ms.empty() ? static_cast<std::int64_t>(i) : how.t_ms[i];
    send(picture);
    av_frame_unref(picture);
  }
  send(nullptr);
  need(av_write_trailer(format) >= 0, "its end");
  avio_closep(&format->pb);
  av_packet_free(&packet);
  av_frame_free(&picture);
  avcodec_free_context(&encoder);
  avformat_free_context(format);
}

}  // namespace touchstone::test
