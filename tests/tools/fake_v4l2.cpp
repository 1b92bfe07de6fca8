// A V4L2 camera that exists in one process only: preloaded, it answers for the file that FAKE_V4L2 names as the kernel
// would for a camera, so that OpenCV's own V4L2 code runs without a device. It sends 320x240 at 50 Hz as YUYV or MJPG,
// with stamps of the monotonic clock; brightness (YUYV) is the number of the picture, modulo 200. Removing the file
// unplugs it; a file of that name with .silent at its end makes it send nothing. FAKE_V4L2_JPEG names the JPEG that it
// sends; FAKE_V4L2_STAMPS=none: stamps are 0.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <fstream>
#include <iterator>
#include <string>

namespace {

constexpr unsigned kWidth = 320;
constexpr unsigned kHeight = 240;
constexpr unsigned kBytes = kWidth * kHeight * 2;

struct FakeCamera {
  int file = -1;  // a timer: readable when a picture is due
  std::uint32_t format = V4L2_PIX_FMT_YUYV;
  std::array<void*, 32> buffers{};
  std::deque<unsigned> queue;
  bool streaming = false;
  bool silent = false;
  unsigned number = 0;
  std::string jpeg;
  int exposure = 156;
};
FakeCamera camera;

const char* name() {
  return std::getenv("FAKE_V4L2");
}

template <class Function>
Function real(const char* symbol) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, symbol));
}

int fail(int number) {
  errno = number;
  return -1;
}

int open_fake() {
  camera = {};
  camera.file = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
  if (const char* file = std::getenv("FAKE_V4L2_JPEG")) {
    std::ifstream in(file, std::ios::binary);
    camera.jpeg.assign(std::istreambuf_iterator<char>(in), {});
  }
  return camera.file;
}

bool is_fake(const char* path) {
  return name() != nullptr && std::strcmp(path, name()) == 0 && ::access(path, F_OK) == 0;
}

void set_format(v4l2_format& format) {
  format.fmt.pix = {};
  format.fmt.pix.width = kWidth;
  format.fmt.pix.height = kHeight;
  format.fmt.pix.pixelformat = camera.format;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.bytesperline = camera.format == V4L2_PIX_FMT_YUYV ? 2 * kWidth : 0;
  format.fmt.pix.sizeimage = kBytes;
}

int set_timer() {
  const bool running = camera.streaming && !camera.silent;
  const long period = running ? 20'000'000 : 0;
  const itimerspec every{{0, period}, {0, period}};
  return ::timerfd_settime(camera.file, 0, &every, nullptr);
}

int dequeue(v4l2_buffer& buffer) {
  const bool silent = ::access((std::string(name()) + ".silent").c_str(), F_OK) == 0;
  if (silent != camera.silent) {
    camera.silent = silent;
    set_timer();
    return fail(EAGAIN);
  }
  std::uint64_t expirations = 0;
  if (::read(camera.file, &expirations, sizeof(expirations)) < 0) return fail(EAGAIN);
  if (camera.queue.empty()) return fail(EAGAIN);
  const unsigned index = camera.queue.front();
  camera.queue.pop_front();
  auto* bytes = static_cast<std::uint8_t*>(camera.buffers[index]);
  unsigned used = kBytes;
  if (camera.format == V4L2_PIX_FMT_YUYV) {
    for (unsigned i = 0; i < kBytes; ++i) bytes[i] = i % 2 == 0 ? static_cast<std::uint8_t>(camera.number % 200) : 128;
  } else {
    used = static_cast<unsigned>(std::min<std::size_t>(camera.jpeg.size(), kBytes));
    std::memcpy(bytes, camera.jpeg.data(), used);
  }
  ++camera.number;
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const char* stamps = std::getenv("FAKE_V4L2_STAMPS");
  buffer.index = index;
  buffer.bytesused = used;
  buffer.length = kBytes;
  buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  buffer.timestamp = {now.tv_sec, now.tv_nsec / 1000};
  if (stamps != nullptr && std::strcmp(stamps, "none") == 0) buffer.timestamp = {};
  buffer.sequence = camera.number;
  return 0;
}

int control(unsigned long request, void* argument) {
  auto& value = *static_cast<v4l2_control*>(argument);
  if (value.id == V4L2_CID_EXPOSURE_AUTO) return 0;
  if (value.id != V4L2_CID_EXPOSURE_ABSOLUTE) return fail(EINVAL);
  if (request == VIDIOC_S_CTRL) camera.exposure = value.value;
  value.value = camera.exposure;
  return 0;
}

int answer(unsigned long request, void* argument) {
  if (::access(name(), F_OK) != 0) return fail(ENODEV);
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& capability = *static_cast<v4l2_capability*>(argument);
      capability = {};
      std::strcpy(reinterpret_cast<char*>(capability.driver), "fake");
      capability.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_DEVICE_CAPS;
      capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    }
    case VIDIOC_ENUMINPUT: {
      auto& input = *static_cast<v4l2_input*>(argument);
      return input.index == 0 ? 0 : fail(EINVAL);
    }
    case VIDIOC_G_INPUT:
    case VIDIOC_S_INPUT:
      return 0;
    case VIDIOC_S_FMT:
    case VIDIOC_TRY_FMT: {
      auto& format = *static_cast<v4l2_format*>(argument);
      const std::uint32_t wanted = format.fmt.pix.pixelformat;
      if (wanted == V4L2_PIX_FMT_YUYV || (wanted == V4L2_PIX_FMT_MJPEG && !camera.jpeg.empty())) camera.format = wanted;
      set_format(format);
      return 0;
    }
    case VIDIOC_G_FMT:
      set_format(*static_cast<v4l2_format*>(argument));
      return 0;
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM: {
      auto& parameters = *static_cast<v4l2_streamparm*>(argument);
      parameters.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
      parameters.parm.capture.timeperframe = {1, 50};
      return 0;
    }
    case VIDIOC_REQBUFS: {
      auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
      wanted.count = std::min<unsigned>(wanted.count, camera.buffers.size());
      camera.queue.clear();
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      buffer.length = kBytes;
      buffer.m.offset = buffer.index * 4096;
      return 0;
    }
    case VIDIOC_QBUF:
      camera.queue.push_back(static_cast<v4l2_buffer*>(argument)->index);
      return 0;
    case VIDIOC_DQBUF:
      return camera.streaming ? dequeue(*static_cast<v4l2_buffer*>(argument)) : fail(EINVAL);
    case VIDIOC_STREAMON:
    case VIDIOC_STREAMOFF: {
      camera.streaming = request == VIDIOC_STREAMON;
      return set_timer();
    }
    case VIDIOC_G_CTRL:
    case VIDIOC_S_CTRL:
      return control(request, argument);
    case VIDIOC_QUERYCTRL: {
      auto& query = *static_cast<v4l2_queryctrl*>(argument);
      if (query.id != V4L2_CID_EXPOSURE_ABSOLUTE && query.id != V4L2_CID_EXPOSURE_AUTO) return fail(EINVAL);
      query.minimum = 1;
      query.maximum = 10000;
      return 0;
    }
    default:
      return fail(ENOTTY);
  }
}

template <class Real>
int open_file(Real original, const char* path, int flags, mode_t mode) {
  return is_fake(path) ? open_fake() : original(path, flags, mode);
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  return open_file(real<int (*)(const char*, int, ...)>("open"), path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  return open_file(real<int (*)(const char*, int, ...)>("open64"), path, flags, mode);
}

int ioctl(int file, unsigned long request, ...) noexcept {
  va_list list;
  va_start(list, request);
  void* argument = va_arg(list, void*);
  va_end(list);
  if (file == camera.file && file >= 0) return answer(request, argument);
  return real<int (*)(int, unsigned long, ...)>("ioctl")(file, request, argument);
}

void* mmap(void* address, size_t length, int protection, int flags, int file, off_t offset) noexcept {
  const auto original = real<void* (*)(void*, size_t, int, int, int, off_t)>("mmap");
  if (file < 0 || file != camera.file) return original(address, length, protection, flags, file, offset);
  void* memory = original(nullptr, length, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  camera.buffers[static_cast<std::size_t>(offset) / 4096] = memory;
  return memory;
}

void* mmap64(void* address, size_t length, int protection, int flags, int file, off64_t offset) noexcept {
  return mmap(address, length, protection, flags, file, offset);
}

int close(int file) {
  if (file == camera.file) camera.file = -1;
  return real<int (*)(int)>("close")(file);
}

}  // extern "C"
