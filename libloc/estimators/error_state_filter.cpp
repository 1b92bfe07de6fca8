#include "libloc/estimators/error_state_filter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <exception>
#include <string>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/core/fifo.hpp"
#include "libloc/estimators/error_state_detail.hpp"

namespace loc {
namespace {

using error_state::Core;
using error_state::Correction;
using error_state::ImuSample;
using error_state::Machine;

// One copy of state and covariance for so many IMU samples: a late measurement starts from the last one before it.
constexpr int kSamplesPerSnapshot = 8;
constexpr std::size_t kOutcomes = 10;
// More than any sensor reads: beyond it products overflow.
constexpr double kMostOfAnImu = 1e6;

// Of measurements that share a time. Where a pose is kept at this time as well, it is the corrected one.
int rank(const Correction& c) {
  return c.keeps_pose ? static_cast<int>(kFusionSources) : static_cast<int>(c.source);
}

bool comes_before(const Correction& a, const Correction& b) {
  return a.time_ns != b.time_ns ? a.time_ns < b.time_ns : rank(a) < rank(b);
}

// A queue whose elements keep their memory when they leave: a snapshot holds a covariance.
class SnapshotQueue {
 public:
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  Core& operator[](std::size_t i) { return slots_[(first_ + i) % slots_.size()]; }
  void push_back(const Core& core) {
    if (size_ == slots_.size()) {
      std::rotate(slots_.begin(), slots_.begin() + static_cast<std::ptrdiff_t>(first_), slots_.end());
      first_ = 0;
      slots_.resize(std::max<std::size_t>(8, 2 * slots_.size()));
    }
    ++size_;
    (*this)[size_ - 1] = core;
  }
  void pop_front() {
    first_ = (first_ + 1) % slots_.size();
    --size_;
  }
  void keep_front(std::size_t count) { size_ = count; }
  void clear() { size_ = 0; }

 private:
  std::vector<Core> slots_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

struct StoredImu : ImuSample {
  double gap_s = 0;  // of a bridged step that ends here
};

}  // namespace

void ErrorStateOptions::check() const {
  noise.check();
  require(gravity.allFinite(), "gravity is not finite");
  require_not_negative("scale_random_walk", scale_random_walk);
  require_positive("drift_sigma", drift_sigma);
  require_positive("drift_time_constant_s", drift_time_constant_s);
  require(clones >= 0 && clones <= error_state::kMaxClones, "clones", clones,
          "must be 0 to " + std::to_string(error_state::kMaxClones));
  require(gate_probability > 0 && gate_probability < 1, "gate_probability", gate_probability, "must be in (0, 1)");
  require(history_ns >= 0, "history_ns", static_cast<double>(history_ns), "must not be negative");
  require(max_step_ns > 0, "max_step_ns", static_cast<double>(max_step_ns), "must be positive");
  require(max_bridge_ns >= max_step_ns, "max_bridge_ns", static_cast<double>(max_bridge_ns),
          "must be at least max_step_ns");
  require_not_negative("bridge_angular_velocity_sigma", bridge_angular_velocity_sigma);
  require_not_negative("bridge_specific_force_sigma", bridge_specific_force_sigma);
}

const char* fusion_source_name(FusionSource source) {
  switch (source) {
    case FusionSource::kOdometry:
      return "odometry";
    case FusionSource::kRelativeOdometry:
      return "relative_odometry";
    case FusionSource::kGps:
      return "gps";
    case FusionSource::kMeasuredVelocity:
      return "velocity";
    case FusionSource::kZeroVelocity:
      return "zero_velocity";
    case FusionSource::kHeight:
      return "height";
    case FusionSource::kHeading:
      return "heading";
    case FusionSource::kModel:
      return "model";
  }
  return "unknown";
}

const char* fusion_outcome_name(FusionOutcome outcome) {
  switch (outcome) {
    case FusionOutcome::kAccepted:
      return "accepted";
    case FusionOutcome::kGated:
      return "gated";
    case FusionOutcome::kWaiting:
      return "waiting";
    case FusionOutcome::kTooLate:
      return "too_late";
    case FusionOutcome::kNotFinite:
      return "not_finite";
    case FusionOutcome::kBadCovariance:
      return "bad_covariance";
    case FusionOutcome::kNoClone:
      return "no_clone";
    case FusionOutcome::kNotStarted:
      return "not_started";
    case FusionOutcome::kTooEarly:
      return "too_early";
    case FusionOutcome::kModelFailed:
      return "model_failed";
  }
  return "unknown";
}

struct ErrorStateFilter::Implementation {
  explicit Implementation(const ErrorStateOptions& options) : machine(options) {}

  Machine machine;
  Core core;
  bool is_started = false;

  // All in time order. corrections: those before `applied` are in the state, the others wait for an IMU sample.
  Fifo<StoredImu> imus;
  Fifo<Correction> corrections;
  std::size_t applied = 0;
  SnapshotQueue snapshots;  // each before the corrections of its own time
  TimeNs last_imu_time = kNoTime;
  int since_snapshot = 0;

  std::vector<FusionResult> finished;
  std::array<std::array<std::int64_t, kOutcomes>, kFusionSources> counts{};
  std::int64_t late = 0;
  std::int64_t bridged = 0;
  std::int64_t gaps = 0;
  std::int64_t imu_not_finite = 0;
  std::int64_t imu_not_increasing = 0;
  std::uint64_t next_id = 1;
  std::exception_ptr failure;  // of a model, until the call that met it ends

  // Says what a model threw, once the filter is in order again.
  void say_failure() {
    if (failure) std::rethrow_exception(std::exchange(failure, nullptr));
  }

  void count(const Correction& c, FusionOutcome outcome, int by = 1) {
    if (!c.keeps_pose) counts[static_cast<std::size_t>(c.source)][static_cast<std::size_t>(outcome)] += by;
  }

  // Applies the next correction, at the time of the core.
  FusionResult apply_next() {
    Correction& c = corrections[applied++];
    FusionResult result;
    result.source = c.source;
    result.time_ns = c.time_ns;
    result.outcome = FusionOutcome::kModelFailed;
    if (c.outcome != FusionOutcome::kModelFailed) {
      try {
        result = machine.apply(core, c);
      } catch (...) {
        failure = std::current_exception();
      }
    }
    if (c.outcome != FusionOutcome::kWaiting) count(c, c.outcome, -1);  // computed anew: the last word counts
    c.outcome = result.outcome;
    count(c, c.outcome);
    return result;
  }

  void apply_due(std::uint64_t wanted, FusionResult& result, bool report) {
    while (applied < corrections.size() && corrections[applied].time_ns <= core.time_ns) {
      const std::uint64_t id = corrections[applied].id;
      const bool waited = report && !corrections[applied].keeps_pose;
      const FusionResult r = apply_next();
      if (id == wanted) result = r;
      if (waited) finished.push_back(r);
    }
  }

  // To the time of a sample, with the corrections on the way and at its end.
  void advance(const StoredImu& imu, std::uint64_t wanted, FusionResult& result, bool report) {
    while (applied < corrections.size() && corrections[applied].time_ns < imu.time_ns) {
      machine.step(core, imu, corrections[applied].time_ns, imu.gap_s);
      apply_due(wanted, result, report);
    }
    machine.step(core, imu, imu.time_ns, imu.gap_s);
    keep_snapshot();
    apply_due(wanted, result, report);
  }

  void keep_snapshot() {
    if (machine.options().history_ns == 0 || ++since_snapshot < kSamplesPerSnapshot) return;
    since_snapshot = 0;
    snapshots.push_back(core);
  }

  void forget_old() {
    const TimeNs oldest = core.time_ns - machine.options().history_ns;
    while (snapshots.size() > 1 && snapshots[1].time_ns <= oldest) snapshots.pop_front();
    const TimeNs begin = snapshots.empty() ? core.time_ns : snapshots[0].time_ns;
    while (!imus.empty() && imus.front().time_ns <= begin) imus.pop_front();
    // At the snapshot's own time corrections are not in it yet.
    while (applied > 0 && (snapshots.empty() || corrections.front().time_ns < begin)) {
      corrections.pop_front();
      --applied;
    }
  }

  // From the last snapshot that is not after this time.
  void compute_anew(TimeNs from, std::uint64_t wanted, FusionResult& result) {
    std::size_t found = snapshots.size();
    while (found > 0 && snapshots[found - 1].time_ns > from) --found;
    core = snapshots[found - 1];
    snapshots.keep_front(found);
    since_snapshot = 0;
    applied = 0;
    while (applied < corrections.size() && corrections[applied].time_ns < core.time_ns) ++applied;
    apply_due(wanted, result, false);
    const TimeNs begin = core.time_ns;
    for (std::size_t i = 0; i < imus.size(); ++i) {
      if (imus[i].time_ns > begin) advance(imus[i], wanted, result, false);
    }
  }

  bool is_too_late(TimeNs time) const {
    if (time >= core.time_ns) return false;
    TimeNs age = 0;
    if (__builtin_sub_overflow(core.time_ns, time, &age) || age > machine.options().history_ns) return true;
    return snapshots.empty() || time < snapshots_begin();
  }
  bool is_too_early(TimeNs time) const {
    TimeNs ahead = 0;
    return time > core.time_ns &&
           (__builtin_sub_overflow(time, core.time_ns, &ahead) || ahead > machine.options().max_bridge_ns);
  }
  TimeNs snapshots_begin() const { return const_cast<SnapshotQueue&>(snapshots)[0].time_ns; }

  FusionResult take(Correction c) {
    FusionResult result;
    result.source = c.source;
    result.time_ns = c.time_ns;
    result.outcome = judge(c);
    if (!is_started) result.outcome = FusionOutcome::kNotStarted;
    if (result.outcome == FusionOutcome::kAccepted && is_too_late(c.time_ns)) {
      result.outcome = FusionOutcome::kTooLate;
    }
    if (result.outcome == FusionOutcome::kAccepted && is_too_early(c.time_ns)) {
      result.outcome = FusionOutcome::kTooEarly;
    }
    if (result.outcome != FusionOutcome::kAccepted) {
      count(c, result.outcome);
      return result;
    }
    result.outcome = FusionOutcome::kWaiting;
    c.id = next_id++;
    const std::uint64_t id = c.id;
    const TimeNs time = c.time_ns;
    std::size_t place = corrections.size();
    while (place > 0 && comes_before(c, corrections[place - 1])) --place;
    corrections.insert(place, std::move(c));
    if (time > core.time_ns) return result;
    if (place < applied || time < core.time_ns) {
      if (place < applied && snapshots.empty()) {
        // Without history the order of equal times is that of arrival.
        std::swap(corrections[place], corrections[applied]);
        result = apply_next();
      } else {
        if (time < core.time_ns) ++late;
        compute_anew(time, id, result);
      }
    } else {
      apply_due(id, result, false);
    }
    forget_old();
    say_failure();
    return result;
  }
};

ErrorStateFilter::ErrorStateFilter(const ErrorStateOptions& options)
    : implementation_(std::make_unique<Implementation>(options)) {}
ErrorStateFilter::ErrorStateFilter(const ErrorStateFilter& other)
    : implementation_(std::make_unique<Implementation>(*other.implementation_)) {}
ErrorStateFilter& ErrorStateFilter::operator=(const ErrorStateFilter& other) {
  if (this != &other) implementation_ = std::make_unique<Implementation>(*other.implementation_);
  return *this;
}
ErrorStateFilter::ErrorStateFilter(ErrorStateFilter&&) noexcept = default;
ErrorStateFilter& ErrorStateFilter::operator=(ErrorStateFilter&&) noexcept = default;
ErrorStateFilter::~ErrorStateFilter() = default;

const ErrorStateOptions& ErrorStateFilter::options() const {
  return implementation_->machine.options();
}
const ErrorStateLayout& ErrorStateFilter::layout() const {
  return implementation_->machine.layout();
}
bool ErrorStateFilter::started() const {
  return implementation_->is_started;
}
TimeNs ErrorStateFilter::time_ns() const {
  return implementation_->core.time_ns;
}
const ErrorStateState& ErrorStateFilter::state() const {
  return implementation_->core.state;
}
const Eigen::MatrixXd& ErrorStateFilter::covariance() const {
  return implementation_->core.covariance;
}
const std::vector<FusionResult>& ErrorStateFilter::finished() const {
  return implementation_->finished;
}

Eigen::Vector3d ErrorStateFilter::angular_velocity() const {
  const Core& core = implementation_->core;
  if (!core.has_imu) return Eigen::Vector3d::Constant(kUnknown);
  return core.last_imu.angular_velocity - core.state.inertial.gyroscope_bias;
}

void ErrorStateFilter::start(TimeNs time_ns, const ErrorStateState& state,
                             const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  Implementation& i = *implementation_;
  const int size = layout().size;
  require(time_ns != kNoTime, "start: no time");
  require(covariance.rows() == size && covariance.cols() == size,
          "start: covariance is " + std::to_string(covariance.rows()) + " x " + std::to_string(covariance.cols()) +
              ", the error state has " + std::to_string(size));
  const InertialState& x = state.inertial;
  require(x.q_world_body.coeffs().allFinite() && std::abs(x.q_world_body.norm() - 1) < 1e-6,
          "start: norm of q_world_body", x.q_world_body.norm(), "must be 1");
  require(x.position.allFinite() && x.velocity.allFinite() && x.gyroscope_bias.allFinite() &&
              x.accelerometer_bias.allFinite() && state.drift.allFinite() && std::isfinite(state.scale),
          "start: the state is not finite");
  require(state.T_body_odometry.translation.allFinite() && state.T_body_odometry.rotation.coeffs().allFinite() &&
              std::abs(state.T_body_odometry.rotation.norm() - 1) < 1e-6,
          "start: T_body_odometry is not a rigid transform");

  Eigen::MatrixXd p = covariance;
  if (layout().clones >= 0) {
    const int clones = size - layout().clones;
    p.rightCols(clones).setZero();
    p.bottomRows(clones).setZero();
  }
  require(p.allFinite(), "start: covariance is not finite");
  const double largest = p.cwiseAbs().maxCoeff();
  require((p - p.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * largest, "start: covariance is not symmetric");
  for (int k = 0; k < size; ++k) {
    require(p(k, k) >= 0, "start: covariance(" + std::to_string(k) + ", " + std::to_string(k) + ")", p(k, k),
            "must not be negative");
  }
  // Semidefinite to rounding: of unit diagonal, so that metres and radians count alike.
  Eigen::VectorXd unit = p.diagonal().cwiseSqrt();
  for (int k = 0; k < size; ++k) unit[k] = unit[k] > 0 ? 1 / unit[k] : 1;
  Eigen::MatrixXd correlation = unit.asDiagonal() * p * unit.asDiagonal();
  correlation.diagonal().array() += 1e-9;
  require(correlation.llt().info() == Eigen::Success, "start: covariance is not positive semidefinite");

  i.core = Core{};
  i.core.time_ns = time_ns;
  i.core.state = state;
  i.core.state.inertial.q_world_body.normalize();
  i.core.state.T_body_odometry.rotation.normalize();
  i.core.covariance = 0.5 * (p + p.transpose());
  i.imus = {};
  i.corrections = {};
  i.applied = 0;
  i.snapshots.clear();
  i.last_imu_time = kNoTime;
  i.since_snapshot = 0;
  i.finished.clear();
  i.is_started = true;
  if (options().history_ns > 0) i.snapshots.push_back(i.core);
}

PredictOutcome ErrorStateFilter::predict(const ImuMeasurement& imu) {
  Implementation& i = *implementation_;
  i.finished.clear();
  if (!i.is_started) return PredictOutcome::kNotStarted;
  if (!(imu.angular_velocity.cwiseAbs().maxCoeff() < kMostOfAnImu) ||
      !(imu.specific_force.cwiseAbs().maxCoeff() < kMostOfAnImu) || imu.angular_velocity.hasNaN() ||
      imu.specific_force.hasNaN() || imu.time_ns == kNoTime) {
    ++i.imu_not_finite;
    return PredictOutcome::kNotFinite;
  }
  const bool first = i.last_imu_time == kNoTime;
  const TimeNs before = first ? i.core.time_ns : i.last_imu_time;
  if (imu.time_ns < before || (imu.time_ns == before && !first)) {
    ++i.imu_not_increasing;
    return PredictOutcome::kTimeNotIncreasing;
  }
  TimeNs length = 0;
  if (__builtin_sub_overflow(imu.time_ns, before, &length) || length > options().max_bridge_ns) {
    ++i.gaps;
    return PredictOutcome::kGap;
  }
  StoredImu stored;
  stored.time_ns = imu.time_ns;
  stored.angular_velocity = imu.angular_velocity;
  stored.specific_force = imu.specific_force;
  const bool bridged = length > options().max_step_ns;
  if (bridged) {
    stored.gap_s = to_seconds(length);
    ++i.bridged;
  }
  i.last_imu_time = imu.time_ns;
  if (length == 0) {
    // The sample of the start: nothing to integrate, but the next step begins with it. It belongs to the snapshot too.
    i.core.last_imu = stored;
    i.core.has_imu = true;
    if (!i.snapshots.empty()) {
      i.snapshots[0].last_imu = stored;
      i.snapshots[0].has_imu = true;
    }
    return PredictOutcome::kFirst;
  }
  if (options().history_ns > 0) i.imus.push_back(stored);
  FusionResult none;
  i.advance(stored, 0, none, true);
  i.forget_old();
  i.say_failure();
  return bridged ? PredictOutcome::kBridged : PredictOutcome::kPredicted;
}

FusionResult ErrorStateFilter::fuse_vo(TimeNs time_ns, const Eigen::Vector3d& position,
                                       const Eigen::Matrix3d& position_cov, const Eigen::Quaterniond& q_world_odometry,
                                       const Eigen::Matrix3d& orientation_cov) {
  Correction c;
  c.source = FusionSource::kOdometry;
  c.time_ns = time_ns;
  c.vector = position;
  c.vector_cov = position_cov;
  c.rotation = q_world_odometry;
  c.second_cov = orientation_cov;
  return implementation_->take(std::move(c));
}

FusionResult ErrorStateFilter::fuse_vo_relative(TimeNs time0_ns, TimeNs time1_ns, const Eigen::Vector3d& position,
                                                const Eigen::Matrix3d& position_cov, const Eigen::Quaterniond& rotation,
                                                const Eigen::Matrix3d& orientation_cov) {
  require(options().clones > 0, "fuse_vo_relative: options.clones is 0, no past pose is kept");
  require(time0_ns < time1_ns, "fuse_vo_relative: time0_ns is not before time1_ns");
  Implementation& i = *implementation_;
  Correction c;
  c.source = FusionSource::kRelativeOdometry;
  c.time_ns = time1_ns;
  c.start_time_ns = time0_ns;
  c.vector = position;
  c.vector_cov = position_cov;
  c.rotation = rotation;
  c.second_cov = orientation_cov;
  // When nobody kept the pose of time0, the history may still give it.
  if (i.is_started && judge(c) == FusionOutcome::kAccepted && !i.is_too_late(time1_ns)) {
    const auto& clones = i.core.clones;
    bool kept = std::any_of(clones.begin(), clones.end(), [&](const auto& x) { return x.time_ns == time0_ns; });
    for (std::size_t k = 0; k < i.corrections.size() && !kept; ++k) {
      const Correction& other = i.corrections[k];
      kept = other.time_ns == time0_ns && (other.keeps_pose || other.source == FusionSource::kRelativeOdometry);
    }
    // Its place must not be one that others, from before time0 to after it, still need.
    int in_use = 0;
    for (std::size_t k = 0; k < i.corrections.size(); ++k) {
      const Correction& other = i.corrections[k];
      in_use +=
          other.source == FusionSource::kRelativeOdometry && other.start_time_ns < time0_ns && other.time_ns > time0_ns
              ? 1
              : 0;
    }
    if (!kept && !i.is_too_late(time0_ns) && in_use < options().clones) keep_pose(time0_ns);
  }
  return i.take(std::move(c));
}

FusionResult ErrorStateFilter::keep_pose(TimeNs time_ns) {
  require(options().clones > 0, "keep_pose: options.clones is 0, no past pose is kept");
  Correction c;
  c.keeps_pose = true;
  c.time_ns = time_ns;
  return implementation_->take(std::move(c));
}

FusionResult ErrorStateFilter::fuse_gps(TimeNs time_ns, const Eigen::Vector3d& position,
                                        const Eigen::Matrix3d& position_cov, const Eigen::Vector3d& antenna,
                                        const Eigen::Vector3d& velocity, const Eigen::Matrix3d& velocity_cov) {
  Correction c;
  c.source = FusionSource::kGps;
  c.time_ns = time_ns;
  c.has_vector = !position.array().isNaN().all();
  c.vector = position;
  c.vector_cov = position_cov;
  c.lever = antenna;
  c.has_velocity = !velocity.array().isNaN().all();
  c.velocity = velocity;
  c.second_cov = velocity_cov;
  return implementation_->take(std::move(c));
}

FusionResult ErrorStateFilter::fuse_velocity(TimeNs time_ns, const Eigen::Vector3d& velocity,
                                             const Eigen::Matrix3d& velocity_cov, VelocityFrame frame) {
  Correction c;
  c.source = FusionSource::kMeasuredVelocity;
  c.time_ns = time_ns;
  c.vector = velocity;
  c.vector_cov = velocity_cov;
  c.frame = frame;
  return implementation_->take(std::move(c));
}

FusionResult ErrorStateFilter::fuse_zero_velocity(TimeNs time_ns, double velocity_sigma,
                                                  const Eigen::Vector3d& angular_velocity,
                                                  double angular_velocity_sigma) {
  Correction c;
  c.source = FusionSource::kZeroVelocity;
  c.time_ns = time_ns;
  c.vector_cov = velocity_sigma * velocity_sigma * Eigen::Matrix3d::Identity();
  c.has_velocity = !angular_velocity.array().isNaN().all();
  if (c.has_velocity) {
    c.velocity = angular_velocity;
    c.second_cov = angular_velocity_sigma * angular_velocity_sigma * Eigen::Matrix3d::Identity();
  }
  return implementation_->take(std::move(c));
}

FusionResult ErrorStateFilter::fuse_height(TimeNs time_ns, double height, double sigma) {
  Correction c;
  c.source = FusionSource::kHeight;
  c.time_ns = time_ns;
  c.value = height;
  c.sigma = sigma;
  return implementation_->take(std::move(c));
}

FusionResult ErrorStateFilter::fuse_heading(TimeNs time_ns, double heading, double sigma) {
  Correction c;
  c.source = FusionSource::kHeading;
  c.time_ns = time_ns;
  c.value = heading;
  c.sigma = sigma;
  return implementation_->take(std::move(c));
}

FusionResult ErrorStateFilter::correct(TimeNs time_ns, MeasurementModel model) {
  require(static_cast<bool>(model), "correct: the model is empty");
  Correction c;
  c.time_ns = time_ns;
  c.model = std::move(model);
  return implementation_->take(std::move(c));
}

FusionResult ErrorStateFilter::residual(const MeasurementModel& model) const {
  require(static_cast<bool>(model), "residual: the model is empty");
  Correction c;
  c.time_ns = time_ns();
  c.model = model;
  if (!started()) return {};
  return implementation_->machine.examine(implementation_->core, c);
}

void ErrorStateFilter::widen(const Eigen::Ref<const Eigen::VectorXd>& variances) {
  Implementation& i = *implementation_;
  require(i.is_started, "widen: the filter is not started");
  require(variances.size() == layout().size, "widen: number of variances", static_cast<double>(variances.size()),
          "must be " + std::to_string(layout().size));
  require(variances.allFinite() && variances.minCoeff() >= 0, "widen: a variance is negative or not finite");
  i.core.covariance.diagonal() += variances;
  while (i.applied > 0) {
    i.corrections.pop_front();
    --i.applied;
  }
  i.imus = {};
  i.snapshots.clear();
  i.since_snapshot = 0;
  if (options().history_ns > 0) i.snapshots.push_back(i.core);
}

NamedCounts ErrorStateFilter::counts() const {
  const Implementation& i = *implementation_;
  NamedCounts counts;
  const auto add = [&](std::string name, std::int64_t value) {
    if (value != 0) counts.push_back({std::move(name), value});
  };
  add("imu.bridged", i.bridged);
  add("imu.gaps", i.gaps);
  add("imu.not_finite", i.imu_not_finite);
  add("imu.time_not_increasing", i.imu_not_increasing);
  add("late", i.late);
  for (std::size_t source = 0; source < kFusionSources; ++source) {
    for (std::size_t outcome = 0; outcome < kOutcomes; ++outcome) {
      add(std::string(fusion_source_name(static_cast<FusionSource>(source))) + "." +
              fusion_outcome_name(static_cast<FusionOutcome>(outcome)),
          i.counts[source][outcome]);
    }
  }
  return counts;
}

}  // namespace loc
