// Pictures from folders, lists and videos as measurements, and the JPEG codec: times, order, damage.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>

#include "libloc/io/csv.hpp"
#include "libloc/io/merged_source.hpp"
#include "libloc/vision/image_codec.hpp"
#include "libloc/vision/image_file.hpp"
#include "libloc/vision/image_source.hpp"
#include "libloc/vision/image_view.hpp"
#include "libloc/vision/video_source.hpp"
#include "tests/support/data.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::count;
using test::expect_data_error;
using test::only;
using test::read_all;
using test::read_file;
using test::TempFolder;

constexpr TimeNs kMs = 1'000'000;

/// Smooth, with edges, different for each number; colour differs from grey.
ImageMeasurement picture(int number, PixelFormat format = PixelFormat::kGray, int width = 64, int height = 48) {
  const bool grey = format == PixelFormat::kGray;
  cv::Mat m(height, width, grey ? CV_8UC1 : CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int value = 40 + 2 * x + y + (x > width / 2 ? 30 : 0) - number;
      if (grey) {
        m.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(value);
      } else {
        m.at<cv::Vec3b>(y, x) = cv::Vec3b(static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(y),
                                          static_cast<std::uint8_t>(255 - value));
      }
    }
  }
  return image_of(m, format);
}

double mean_difference(const ImageMeasurement& a, const ImageMeasurement& b) {
  EXPECT_EQ(a.data->size(), b.data->size());
  return cv::norm(view_of(a), view_of(b), cv::NORM_L1) / static_cast<double>(a.data->size());
}

std::vector<TimeNs> times(const std::vector<Measurement>& all) {
  std::vector<TimeNs> out;
  for (const Measurement& m : all) out.push_back(stamp_of(m).time_ns);
  return out;
}

std::string bytes_of(const ImageMeasurement& jpeg) {
  return {jpeg.data->begin(), jpeg.data->end()};
}

ImageMeasurement jpeg_of(const std::string& bytes, const ImageMeasurement& like) {
  ImageMeasurement out = like;
  out.format = PixelFormat::kMjpeg;
  out.data = std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end());
  return out;
}

class ImageFiles : public ::testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  void save(const std::string& name, int number, PixelFormat format = PixelFormat::kGray) const {
    std::filesystem::create_directories(path(name).parent_path());
    write_image(path(name), picture(number, format));
  }
  TempFolder folder_;
};

using ImageCodec = ImageFiles;
using ImageLists = ImageFiles;
using ImageSources = ImageFiles;
using Videos = ImageFiles;

TEST_F(ImageCodec, JpegAndBackKeepsThePictureAndWhatBelongsToIt) {
  for (const PixelFormat format : {PixelFormat::kGray, PixelFormat::kBgr}) {
    ImageMeasurement image = picture(3, format);
    image.time_ns = 17;
    image.camera = 2;
    image.exposure_ns = 5;
    const ImageMeasurement jpeg = encode_jpeg(image, 95);
    EXPECT_EQ(jpeg.format, PixelFormat::kMjpeg);
    EXPECT_EQ(jpeg.row_stride_bytes, 0);
    EXPECT_LT(jpeg.data->size(), image.data->size());
    const ImageMeasurement back = decode_image(jpeg, format);
    EXPECT_EQ(back.format, format);
    EXPECT_EQ(back.time_ns, 17);
    EXPECT_EQ(back.camera, 2);
    EXPECT_EQ(back.exposure_ns, 5);
    EXPECT_LT(mean_difference(back, image), format == PixelFormat::kGray ? 1.0 : 3.0);
    EXPECT_LT(encode_jpeg(image, 30).data->size(), jpeg.data->size());
    EXPECT_EQ(encode_jpeg(jpeg).data, jpeg.data) << "a JPEG stays as it is";
  }
  EXPECT_THROW(encode_jpeg(picture(1), 0), std::invalid_argument);
}

TEST_F(ImageCodec, GreyOfColourIsThatOfThePixels) {
  const ImageMeasurement colour = picture(3, PixelFormat::kBgr);
  const ImageMeasurement grey = decode_image(colour, PixelFormat::kGray);
  EXPECT_NEAR((*grey.data)[100],
              0.114 * (*colour.data)[300] + 0.587 * (*colour.data)[301] + 0.299 * (*colour.data)[302], 0.51);
  ImageMeasurement swapped = colour;
  swapped.format = PixelFormat::kRgb;
  EXPECT_GT(mean_difference(decode_image(swapped), grey), 5);
  EXPECT_LT(mean_difference(decode_image(encode_jpeg(swapped, 100)), decode_image(swapped)), 1.5);
  EXPECT_EQ(decode_image(grey).data, grey.data) << "nothing is copied";
}

TEST_F(ImageCodec, AJpegThatIsCutAtAnyByteIsRefused) {
  const ImageMeasurement whole = encode_jpeg(picture(1));
  const std::string bytes = bytes_of(whole);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const ImageMeasurement part = jpeg_of(bytes.substr(0, size), whole);
    EXPECT_THROW(decode_image(part), DataError) << size << " of " << bytes.size();
    EXPECT_THROW(jpeg_image(part.data), DataError) << size << " of " << bytes.size();
  }
  EXPECT_NO_THROW(decode_image(jpeg_of(bytes + std::string(100, '\0'), whole))) << "cameras fill up their buffers";
  EXPECT_EQ(jpeg_image(jpeg_of(bytes + "more", whole).data).width_px, 64);
}

TEST_F(ImageCodec, ChangedBytesNeverCrashAndTheSizeMustBeTheSaidOne) {
  const ImageMeasurement whole = encode_jpeg(picture(1));
  const std::string bytes = bytes_of(whole);
  int refused = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (const char value : {'\0', '\xff', '\x7f'}) {
      std::string changed = bytes;
      changed[i] = value;
      try {
        const ImageMeasurement back = decode_image(jpeg_of(changed, whole));
        EXPECT_EQ(back.data->size(), 64U * 48U);
      } catch (const DataError&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, static_cast<int>(bytes.size()) / 2);
  ImageMeasurement wrong = whole;
  wrong.width_px = 65;
  expect_data_error([&] { decode_image(wrong); }, {"64 x 48", "65 x 48"});
  std::string huge = bytes;
  const auto at = huge.find("\xff\xc0") + 5;
  huge.replace(at, 4, "\xfd\xe8\xfd\xe8");
  expect_data_error([&] { jpeg_image(jpeg_of(huge, whole).data); }, {"65000 x 65000", "too large"});
}

TEST_F(ImageLists, NumberedPicturesAtARate) {
  for (const int i : {0, 2, 9, 10, 100}) save("n/frame_" + std::to_string(i) + ".png", i);
  folder_.write("n/notes.txt", "no picture");
  folder_.write("n/._frame_3.png", "what a Mac leaves behind");
  const auto source = open_image_folder(path("n"), {.rate_hz = 10, .first_time_ns = 5});
  const auto all = read_all(*source);
  EXPECT_EQ(times(all), (std::vector<TimeNs>{5, 200 * kMs + 5, 900 * kMs + 5, 1000 * kMs + 5, 10'000 * kMs + 5}));
  EXPECT_EQ(count(source->counts(), "image.read"), 5);
  EXPECT_EQ(count(source->counts(), "image.missing_numbers"), 96);
  EXPECT_EQ(mean_difference(std::get<ImageMeasurement>(all[3]), picture(10)), 0);

  for (const int i : {5, 10, 20}) save("step/" + std::to_string(i) + ".png", i);
  const ImageList step = list_images_at_rate(path("step"), 1);
  EXPECT_EQ(step.entries.back().time_ns, 3'000 * kMs);
  save("step/22.png", 22);
  save("step/25.png", 22);
  expect_data_error([&] { list_images_at_rate(path("step"), 1); }, {"step/10.png", "does not fit"});
  for (const char* name : {"b", "a", "c"}) save("names/" + std::string(name) + ".png", 1);
  EXPECT_EQ(list_images_at_rate(path("names"), 1).entries[2].file.filename(), "c.png");
  save("two/left1.png", 1);
  save("two/right1.png", 1);
  expect_data_error([&] { list_images_at_rate(path("two"), 1); }, {"right1.png", "two series"});
  EXPECT_THROW(list_images_at_rate(path("n"), -1), std::invalid_argument);
}

TEST_F(ImageLists, NamesThatAreTimes) {
  for (const char* name : {"1403636584763555584", "1403636584813555456", "1403636584863555584"}) {
    save("ns/" + std::string(name) + ".png", 1);
  }
  EXPECT_EQ(list_images_by_name(path("ns"), "ns").entries[1].time_ns, 1403636584813555456);
  save("s/1305031102.175304.png", 1);
  save("s/1305031102.211214.png", 1);
  save("s/1305031102.2112140.png", 1);
  const ImageList list = list_images_by_name(path("s"), "s");
  ASSERT_EQ(list.entries.size(), 2U);
  EXPECT_EQ(list.entries[0].time_ns, 1305031102175304000);
  EXPECT_EQ(count(list.counts, "image.skipped.time_not_increasing"), 1);
  save("s/first.png", 1);
  expect_data_error([&] { list_images_by_name(path("s"), "s"); }, {"first.png", "not a time in s"});
  expect_data_error([&] { list_images_by_name(path("s"), "min"); }, {"'min'", "ns, us, ms or s"});
  // Times taken for numbers of a series.
  save("ns/1403636584913555600.png", 1);
  expect_data_error([&] { list_images_at_rate(path("ns"), 20); }, {"unit in place of a rate"});
}

TEST_F(ImageLists, ListsOfTimesAndNames) {
  for (int i = 0; i < 3; ++i) save("tum/rgb/" + std::to_string(i) + ".png", i);
  folder_.write("tum/rgb.txt",
                "# color images\n# timestamp filename\n10.5 rgb/0.png\n10.6 rgb/1.png\n10.55 rgb/2.png\n");
  const auto tum = open_image_folder(path("tum"), {});
  EXPECT_EQ(times(read_all(*tum)), (std::vector<TimeNs>{10'500 * kMs, 10'600 * kMs}));
  EXPECT_EQ(count(tum->counts(), "image.skipped.time_not_increasing"), 1);

  // KITTI: times alone, one for each picture.
  const auto list = folder_.write("times.txt", "0.0e+00\n1.03736e-01\n2.07348e-01\n");
  const ImageList kitti = read_image_list(list, path("tum/rgb"));
  ASSERT_EQ(kitti.entries.size(), 3U);
  EXPECT_EQ(kitti.entries[1].time_ns, 103'736'000);
  EXPECT_EQ(kitti.entries[2].file, path("tum/rgb/2.png"));
  folder_.write("times.txt", "0.0\n0.1\n");
  expect_data_error([&] { read_image_list(list, path("tum/rgb")); }, {"times.txt", "2 times", "3 pictures"});
  folder_.write("times.txt", "0.0\n0.1 a.png\n");
  expect_data_error([&] { read_image_list(list, path("tum/rgb")); }, {"times.txt:2", "before have none"});
  folder_.write("times.txt", "0.0 a.png\nsoon b.png\n");
  expect_data_error([&] { read_image_list(list, path("tum/rgb")); }, {"times.txt:2", "soon"});
  folder_.write("times.txt", "#timestamp [us],filename\n7,a b.png\n9,c.png\n11,d.p");
  const ImageList cut = read_image_list(list, path(""));
  ASSERT_EQ(cut.entries.size(), 2U);
  EXPECT_EQ(cut.entries[0].time_ns, 7000);
  EXPECT_EQ(cut.entries[0].file, path("a b.png"));
  EXPECT_EQ(count(cut.counts, "image.skipped.no_line_end"), 1);
  folder_.write("times.txt", "# nothing\n");
  expect_data_error([&] { read_image_list(list, path("")); }, {"no complete line"});

  save("untimed/1.png", 1);
  expect_data_error([&] { open_image_folder(path("untimed"), {}); }, {"untimed", "rate"});
  expect_data_error([&] { open_image_folder(path("none"), {}); }, {"none", "no such folder"});
  std::filesystem::create_directories(path("empty"));
  expect_data_error([&] { open_image_folder(path("empty"), {.rate_hz = 1}); }, {"no pictures"});
  EXPECT_THROW(open_image_folder(path("n"), {.rate_hz = 1, .name_unit = "ns"}), std::invalid_argument);
}

TEST_F(ImageSources, WhatIsMissingOrDamagedIsLeftOutAndTold) {
  for (int i = 0; i < 6; ++i) save("p/" + std::to_string(i) + ".png", i);
  const std::string png = read_file(path("p/1.png"));
  folder_.write("p/1.png", png.substr(0, png.size() / 2));
  folder_.write("p/2.png", "");
  write_image(path("p/4.png"), picture(1, PixelFormat::kGray, 32, 48));
  ImageList list = list_images_at_rate(path("p"), 10);
  list.entries.push_back({list.entries.back().time_ns + 1, path("p/9.png")});
  std::vector<std::string> told;
  const ImageReadOptions options{.on_skip = [&](const std::string& why) { told.push_back(why); }};
  const auto source = open_images(list, "p", 1, options);
  const auto images = only<ImageMeasurement>(read_all(*source));
  ASSERT_EQ(images.size(), 3U);
  EXPECT_EQ(images[1].time_ns, 300 * kMs);
  EXPECT_EQ(images[1].sequence, 3) << "the jump says that two were lost";
  EXPECT_EQ(images[1].camera, 1);
  EXPECT_EQ(images[1].width_px, 64);
  EXPECT_EQ(count(source->counts(), "image.skipped.damaged"), 2);
  EXPECT_EQ(count(source->counts(), "image.skipped.other_size"), 1);
  EXPECT_EQ(count(source->counts(), "image.skipped.missing"), 1);
  ASSERT_EQ(told.size(), 4U);
  EXPECT_NE(told[1].find("2.png: is empty"), std::string::npos);
  EXPECT_NE(told[2].find("4.png: has 32 x 48"), std::string::npos);

  ImageList none;
  none.entries = {{0, path("p/1.png")}, {1, path("nowhere.png")}};
  const auto empty = open_images(none, "camera");
  expect_data_error([&] { empty->next(); }, {"camera", "none of its 2", "1.png"});
}

TEST_F(ImageSources, ColourAndJpegAsTheyAreStored) {
  save("c/0.png", 1, PixelFormat::kBgr);
  write_image(path("c/1.jpg"), picture(1, PixelFormat::kBgr));
  const ImageList list = list_images_at_rate(path("c"), 1);
  const auto as = [&](PixelFormat format) {
    return only<ImageMeasurement>(read_all(*open_images(list, "c", 0, {.format = format})));
  };
  EXPECT_EQ(as(PixelFormat::kGray)[0].format, PixelFormat::kGray);
  EXPECT_EQ(mean_difference(as(PixelFormat::kBgr)[0], picture(1, PixelFormat::kBgr)), 0);
  const auto stored = as(PixelFormat::kMjpeg);
  EXPECT_EQ(stored[0].format, PixelFormat::kBgr);
  EXPECT_EQ(stored[1].format, PixelFormat::kMjpeg);
  EXPECT_EQ(stored[1].height_px, 48);
  EXPECT_EQ(bytes_of(stored[1]), read_file(path("c/1.jpg")));
  EXPECT_LT(mean_difference(decode_image(stored[1], PixelFormat::kBgr), picture(1, PixelFormat::kBgr)), 5);
  const std::string jpeg = read_file(path("c/1.jpg"));
  folder_.write("c/1.jpg", jpeg.substr(0, jpeg.size() - 40));
  for (const PixelFormat format : {PixelFormat::kGray, PixelFormat::kMjpeg}) {
    EXPECT_EQ(as(format).size(), 1U) << "a JPEG that was cut off is no picture";
  }
  EXPECT_THROW(as(PixelFormat::kRgb), std::invalid_argument);
}

TEST_F(ImageSources, AnEurocRecordingWithItsImuAndTwoCameras) {
  folder_.write("r/mav0/imu0/data.csv",
                "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],"
                "a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n100,0,0,0,0,0,9.8\n110,0,0,0,0,0,9.8\n120,0,0,0,0,0,9.8\n");
  for (const int camera : {0, 1}) {
    const std::string base = "r/mav0/cam" + std::to_string(camera);
    folder_.write(base + "/data.csv", "#timestamp [ns],filename\n105,a.png\r\n110,b.png\n");
    save(base + "/data/a.png", camera);
    save(base + "/data/b.png", camera + 10);
  }
  const auto all = read_all(*open_euroc_images(path("r")));
  EXPECT_EQ(times(all), (std::vector<TimeNs>{100, 105, 105, 110, 110, 110, 120}));
  EXPECT_EQ(camera_of(all[2]), 1);
  EXPECT_EQ(kind_of(all[5]), StreamKind::kImu) << "the IMU comes last of one time";
  EXPECT_EQ(mean_difference(std::get<ImageMeasurement>(all[4]), picture(11)), 0);
  EurocImageOptions second;
  second.cameras = {1};
  second.read_other = false;
  EXPECT_EQ(read_all(*open_euroc_images(path("r"), second)).size(), 2U);
  second.cameras = {2};
  expect_data_error([&] { open_euroc_images(path("r"), second); }, {"cam2/data.csv", "no such file"});

  std::filesystem::remove_all(path("r/mav0/imu0"));
  EXPECT_EQ(read_all(*open_euroc_images(path("r"))).size(), 4U) << "pictures without an IMU";
  const auto other = open_euroc(path("r"));
  EXPECT_FALSE(other->next());
  EXPECT_EQ(count(other->counts(), "imu.absent"), 1);
  std::filesystem::remove_all(path("r/mav0/cam0"));
  std::filesystem::remove_all(path("r/mav0/cam1"));
  expect_data_error([&] { open_euroc_images(path("r")); }, {"imu0/data.csv", "nor any other stream"});
}

TEST_F(ImageSources, RealPicturesOfEuroc) {
  LOC_DATA_OR_SKIP(folder, "euroc-mh01-images");
  EurocImageOptions options;
  options.read.format = PixelFormat::kMjpeg;
  const auto source = open_euroc_images(folder, options);
  const auto images = only<ImageMeasurement>(read_all(*source));
  ASSERT_EQ(images.size(), 600U);
  EXPECT_EQ(images[0].time_ns, 1403636584763555584);
  EXPECT_EQ(count(source->counts(), "imu.absent"), 1);
  for (std::size_t i = 1; i < images.size(); ++i)
    ASSERT_NEAR(to_seconds(images[i].time_ns - images[i - 1].time_ns), 0.05, 1e-3);
  const cv::Mat decoded = view_of(decode_image(images[100])).clone();
  EXPECT_EQ(decoded.size(), cv::Size(752, 480));
  const double mean = cv::mean(decoded)[0];
  EXPECT_GT(mean, 20);
  EXPECT_LT(mean, 200);
}

/// Frames of plain grey, 4 * number, at 20 Hz.
void write_video(const std::filesystem::path& file, int frames) {
  cv::VideoWriter writer(file.string(), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('F', 'F', 'V', '1'), 20, {64, 48});
  ASSERT_TRUE(writer.isOpened());
  for (int i = 0; i < frames; ++i) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(4 * i)));
}

TEST_F(Videos, FramesWithTheTimesOfTheFile) {
  write_video(path("v.mkv"), 10);
  const auto source = open_video(path("v.mkv"), {.camera = 3, .start_time_ns = 7});
  const auto images = only<ImageMeasurement>(read_all(*source));
  ASSERT_EQ(images.size(), 10U);
  for (std::size_t i = 0; i < images.size(); ++i) {
    EXPECT_EQ(images[i].time_ns, 7 + static_cast<TimeNs>(i) * 50 * kMs);
    EXPECT_EQ(images[i].sequence, static_cast<std::int64_t>(i));
    EXPECT_EQ(images[i].camera, 3);
    EXPECT_EQ(images[i].format, PixelFormat::kGray);
    EXPECT_NEAR((*images[i].data)[1000], 4 * static_cast<double>(i), 1.5);
  }
  EXPECT_EQ(source->counts().size(), 1U) << "nothing to remark";
  const auto colour = open_video(path("v.mkv"), {.format = PixelFormat::kBgr, .rate_hz = 10});
  const auto frames = only<ImageMeasurement>(read_all(*colour));
  EXPECT_EQ(frames[9].time_ns, 900 * kMs);
  EXPECT_EQ(frames[9].row_stride_bytes, 3 * 64);
}

// Matroska holds the time of a frame as 16 bits [ms] after the length and the track of its block.
std::vector<std::size_t> places_of_times(const std::string& file) {
  std::vector<std::size_t> out;
  std::size_t at = file.find("\x1f\x43\xb6\x75");
  while ((at = file.find('\xa3', at)) != std::string::npos) {
    ++at;
    if (at + 4 < file.size() && (file[at] & '\x80') != 0 && file[at + 1] == '\x81') out.push_back(at + 2);
  }
  return out;
}

TEST_F(Videos, AVaryingRateIsKeptAndTold) {
  write_video(path("v.mkv"), 10);
  std::string bytes = read_file(path("v.mkv"));
  const auto places = places_of_times(bytes);
  ASSERT_EQ(places.size(), 10U);
  const std::array<int, 10> ms{0, 50, 107, 150, 200, 380, 430, 430, 500, 550};
  for (std::size_t i = 0; i < ms.size(); ++i) {
    bytes[places[i]] = static_cast<char>(ms[i] >> 8);
    bytes[places[i] + 1] = static_cast<char>(ms[i] & 0xff);
  }
  const auto source = open_video(folder_.write("varying.mkv", bytes));
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 10U);
  for (std::size_t i = 0; i < ms.size(); ++i) {
    // The eighth has the time of the one before it: the rate tells.
    EXPECT_EQ(stamp_of(all[i]).time_ns, (i == 7 ? 480 : ms[i]) * kMs) << i;
  }
  EXPECT_EQ(count(source->counts(), "video.rate_varies"), 1);
  EXPECT_EQ(count(source->counts(), "video.times_from_rate"), 1);
}

TEST_F(Videos, WhatIsCutOffOrNoVideoIsTold) {
  write_video(path("v.mkv"), 10);
  const std::string bytes = read_file(path("v.mkv"));
  const auto cut = open_video(folder_.write("cut.mkv", bytes.substr(0, places_of_times(bytes)[6] - 3)));
  EXPECT_EQ(read_all(*cut).size(), 6U);
  EXPECT_EQ(count(cut->counts(), "video.missing_at_end_ms"), 200);
  expect_data_error([&] { open_video(folder_.write("head.mkv", bytes.substr(0, 500))); }, {"head.mkv"});
  expect_data_error([&] { open_video(folder_.write("text.mp4", "no video")); }, {"text.mp4", "no video"});
  expect_data_error([&] { open_video(path("none.mp4")); }, {"none.mp4", "no such file"});
  EXPECT_THROW(open_video(path("v.mkv"), {.rate_hz = -1}), std::invalid_argument);
}

TEST_F(Videos, WithTheImuOfAnotherFile) {
  write_video(path("v.mkv"), 10);
  std::string csv = "time_s,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2\n";
  for (int i = 0; i < 100; ++i) csv += to_text(20 + 0.01 * i, 9) + ",0,0,0,0,0,9.8\n";
  const auto file = folder_.write("imu.csv", csv);
  const auto open = [&](TimeNs start_ns) {
    return open_video_with(path("v.mkv"), {.start_time_ns = start_ns}, open_csv(file), "imu.csv");
  };
  const auto all = read_all(*open(20'202 * kMs));
  ASSERT_EQ(all.size(), 110U);
  EXPECT_TRUE(std::ranges::is_sorted(times(all)));
  EXPECT_EQ(kind_of(all[21]), StreamKind::kImage);
  expect_data_error([&] { read_all(*open(0)); }, {"v.mkv", "0.450000000", "imu.csv", "20.000000000", "one clock"});
  expect_data_error([&] { read_all(*open(90'000 * kMs)); }, {"imu.csv", "20.990000000", "v.mkv", "90.000000000"});
}

}  // namespace
}  // namespace loc
