// OpenCV tells on the screen which codecs it tried; the library is silent. Internal to vision.
#pragma once

namespace loc {

/// While it lives, OpenCV logs nothing.
class OpenCvSilence {
 public:
  OpenCvSilence();
  OpenCvSilence(const OpenCvSilence&) = delete;
  OpenCvSilence& operator=(const OpenCvSilence&) = delete;
  ~OpenCvSilence();

 private:
  int before_;
};

}  // namespace loc
