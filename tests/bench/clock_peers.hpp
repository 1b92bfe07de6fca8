// Other ways to put device times on the host's clock, each in the form in which it is found in the field: what the
// clock model is compared with. Times relative to the first sample, in seconds, because they are small there.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "libloc/core/time.hpp"

namespace loc::bench {

/// The arrival is taken for the time.
class ArrivalTime {
 public:
  TimeNs update(TimeNs /*device_ns*/, TimeNs host_ns) { return host_ns; }
};

/// One straight line through all samples so far, by running sums.
class GrowingLeastSquares {
 public:
  TimeNs update(TimeNs device_ns, TimeNs host_ns) {
    if (count_ == 0) {
      device_0_ = device_ns;
      host_0_ = host_ns;
    }
    const double x = to_seconds(device_ns - device_0_);
    const double y = static_cast<double>(host_ns - host_0_ - (device_ns - device_0_));
    // Welford's form: plain sums of squares lose the digits.
    ++count_;
    const double dx = x - mean_x_;
    mean_x_ += dx / static_cast<double>(count_);
    mean_y_ += (y - mean_y_) / static_cast<double>(count_);
    xx_ += dx * (x - mean_x_);
    xy_ += dx * (y - mean_y_);
    const double slope = xx_ > 0 ? xy_ / xx_ : 0;
    return host_0_ + (device_ns - device_0_) + std::llround(mean_y_ + slope * (x - mean_x_));
  }

 private:
  TimeNs device_0_ = 0;
  TimeNs host_0_ = 0;
  std::int64_t count_ = 0;
  double mean_x_ = 0, mean_y_ = 0, xx_ = 0, xy_ = 0;
};

/// One straight line through all samples so far, summed up from the first one with every new one.
class RefitLeastSquares {
 public:
  TimeNs update(TimeNs device_ns, TimeNs host_ns) {
    x_.push_back(to_seconds(device_ns));
    y_.push_back(static_cast<double>(host_ns - device_ns));
    double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      mean_x += x_[i] / static_cast<double>(x_.size());
      mean_y += (y_[i] - y_[0]) / static_cast<double>(x_.size());
    }
    for (std::size_t i = 0; i < x_.size(); ++i) {
      xx += (x_[i] - mean_x) * (x_[i] - mean_x);
      xy += (x_[i] - mean_x) * (y_[i] - y_[0] - mean_y);
    }
    const double slope = xx > 0 ? xy / xx : 0;
    return device_ns + std::llround(y_[0] + mean_y + slope * (x_.back() - mean_x));
  }

 private:
  std::vector<double> x_;
  std::vector<double> y_;
};

/// Lower convex hull of all samples so far; the line is its edge under the middle of the time span. Where the
/// oscillator wanders, an edge may be as long as the recording.
class ConvexHull {
 public:
  TimeNs update(TimeNs device_ns, TimeNs host_ns) {
    if (hull_.empty()) {
      device_0_ = device_ns;
      host_0_ = host_ns;
    }
    const Point p{to_seconds(device_ns - device_0_), static_cast<double>(host_ns - host_0_ - (device_ns - device_0_))};
    while (hull_.size() >= 2 && cross(hull_[hull_.size() - 2], hull_.back(), p) <= 0) hull_.pop_back();
    hull_.push_back(p);
    double value = p.y;
    if (hull_.size() >= 2) {
      // Binary search: the hull is in order of x.
      std::size_t low = 0;
      std::size_t high = hull_.size() - 1;
      const double middle = p.x / 2;
      while (high - low > 1) {
        const std::size_t between = (low + high) / 2;
        (hull_[between].x <= middle ? low : high) = between;
      }
      const Point& a = hull_[low];
      const Point& b = hull_[high];
      value = a.y + (b.y - a.y) / (b.x - a.x) * (p.x - a.x);
    }
    return host_0_ + (device_ns - device_0_) + std::llround(value);
  }

 private:
  struct Point {
    double x = 0, y = 0;
  };
  static double cross(const Point& a, const Point& b, const Point& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  }

  TimeNs device_0_ = 0;
  TimeNs host_0_ = 0;
  std::vector<Point> hull_;
};

}  // namespace loc::bench
