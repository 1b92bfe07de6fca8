#include "libloc/vision/opencv_log.hpp"

#include <opencv2/core/utils/logger.hpp>

namespace loc {

namespace logging = cv::utils::logging;

OpenCvSilence::OpenCvSilence() : before_(logging::setLogLevel(logging::LOG_LEVEL_SILENT)) {}

OpenCvSilence::~OpenCvSilence() {
  logging::setLogLevel(static_cast<logging::LogLevel>(before_));
}

}  // namespace loc
