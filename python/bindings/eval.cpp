// eval/, and what it rests on: trajectories, alignment, errors against a reference, consistency.
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/eval/consistency.hpp"
#include "libloc/eval/orientation_error.hpp"
#include "libloc/eval/trajectory_error.hpp"

namespace locpy {
namespace {

using loc::AbsoluteError;
using loc::Alignment;
using loc::AlignmentMode;
using loc::Association;
using loc::ErrorStatistics;
using loc::OrientationError;
using loc::RelativeError;
using loc::Trajectory;

/// Rows as they stand: whether they are unit quaternions is for the library to judge.
std::vector<Eigen::Quaterniond> quaternions(const Rows<4>& rows) {
  std::vector<Eigen::Quaterniond> out;
  out.reserve(static_cast<std::size_t>(rows.rows()));
  for (Eigen::Index i = 0; i < rows.rows(); ++i) out.emplace_back(rows(i, 0), rows(i, 1), rows(i, 2), rows(i, 3));
  return out;
}

Trajectory make_trajectory(const TimeArray& times, const FloatArray& q, const FloatArray& position) {
  const auto t = times_view(times, "times_ns");
  const auto n = static_cast<py::ssize_t>(t.size());
  const auto rotations = quaternions(rows_view<4>(q, "q_world_body_wxyz", n, "times_ns"));
  const auto positions = rows_view<3>(position, "position", n, "times_ns");
  Trajectory out;
  for (std::size_t i = 0; i < t.size(); ++i) {
    out.push_back(t[i], {.rotation = rotations[i], .translation = positions.row(static_cast<Eigen::Index>(i))});
  }
  out.check("trajectory");
  return out;
}

template <class T>
py::array_t<T> copied(const std::vector<T>& values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::array_t<std::int64_t> indices(const std::vector<std::size_t>& values) {
  py::array_t<std::int64_t> out(static_cast<py::ssize_t>(values.size()));
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

AlignmentMode parse_mode(const std::string& name) {
  for (const auto mode : {AlignmentMode::kNone, AlignmentMode::kSe3, AlignmentMode::kSim3, AlignmentMode::kYaw}) {
    if (name == loc::alignment_name(mode)) return mode;
  }
  throw py::value_error("alignment = '" + name + "': must be 'none', 'se3', 'sim3' or 'yaw'");
}

loc::DeltaUnit parse_unit(const std::string& name) {
  if (name == "frames") return loc::DeltaUnit::kFrames;
  if (name == "seconds") return loc::DeltaUnit::kSeconds;
  if (name == "metres") return loc::DeltaUnit::kMetres;
  throw py::value_error("unit = '" + name + "': must be 'frames', 'seconds' or 'metres'");
}

void bind_trajectory(py::module_& m) {
  py::class_<Trajectory>(m, "Trajectory", "Poses T_world_body over time.")
      .def(py::init(&make_trajectory), py::arg("times_ns"), py::arg("q_world_body_wxyz"), py::arg("position"),
           "int64 (N,), increasing; float64 (N, 4), unit; float64 (N, 3) [m]. DataError names the index and the value "
           "when times do not increase or a pose is not one.")
      .def("__len__", &Trajectory::size)
      .def_property_readonly(
          "times_ns", [](const Trajectory& self) { return copied(self.times_ns); }, "(N,) int64, a copy")
      .def_property_readonly(
          "q_world_body_wxyz",
          [](const Trajectory& self) {
            py::array_t<double> out({static_cast<py::ssize_t>(self.size()), py::ssize_t{4}});
            double* row = out.mutable_data();
            for (const loc::Pose3& pose : self.poses) {
              write_wxyz(pose.rotation, row);
              row += 4;
            }
            return out;
          },
          "(N, 4), a copy")
      .def_property_readonly(
          "position",
          [](const Trajectory& self) {
            py::array_t<double> out({static_cast<py::ssize_t>(self.size()), py::ssize_t{3}});
            double* row = out.mutable_data();
            for (const loc::Pose3& pose : self.poses) {
              Eigen::Map<Eigen::Vector3d>{row} = pose.translation;
              row += 3;
            }
            return out;
          },
          "(N, 3) [m], a copy")
      .def(
          "pose_at", [](const Trajectory& self, loc::TimeNs time_ns) { return loc::interpolate(self, time_ns); },
          py::arg("time_ns"), "Interpolated pose; None outside the trajectory.");
}

void bind_alignment(py::module_& m) {
  py::class_<Alignment>(m, "Alignment", "reference = T_reference_estimate * (scale * estimate)")
      .def_property_readonly("ok", &Alignment::ok)
      .def_property_readonly(
          "failure",
          [](const Alignment& self) {
            return self.ok() ? std::string() : std::string(loc::alignment_failure_text(self.failure));
          },
          "Why the points do not determine a transform; empty when they do.")
      .def_readonly("T_reference_estimate", &Alignment::T_reference_estimate)
      .def_readonly("scale", &Alignment::scale)
      .def_readonly("rms_residual", &Alignment::rms_residual, "[m] after the alignment")
      .def_property_readonly(
          "extent", [](const Alignment& self) { return to_array(self.extent); },
          "(3,) [m] deviations of the reference points along their principal axes, the largest first");
  m.def(
      "align_points",
      [](const FloatArray& estimate, const FloatArray& reference, const std::string& alignment) {
        const auto e = rows_view<3>(estimate, "estimate");
        const auto r = rows_view<3>(reference, "reference", e.rows(), "estimate");
        std::vector<Eigen::Vector3d> from;
        std::vector<Eigen::Vector3d> to;
        for (Eigen::Index i = 0; i < e.rows(); ++i) {
          from.emplace_back(e.row(i));
          to.emplace_back(r.row(i));
        }
        return loc::align_points(from, to, parse_mode(alignment));
      },
      py::arg("estimate"), py::arg("reference"), py::arg("alignment") = "se3",
      "Least-squares transform between points (N, 3) [m] that belong together (Umeyama): \"se3\", \"sim3\" (with "
      "scale), \"yaw\" (turn about z and translation) or \"none\".");
}

void bind_statistics(py::module_& m) {
  py::class_<ErrorStatistics>(m, "ErrorStatistics", "In the unit of the errors (sse: its square).")
      .def_readonly("count", &ErrorStatistics::count)
      .def_readonly("rmse", &ErrorStatistics::rmse)
      .def_readonly("mean", &ErrorStatistics::mean)
      .def_readonly("median", &ErrorStatistics::median)
      .def_readonly("std", &ErrorStatistics::std, "of the population")
      .def_readonly("min", &ErrorStatistics::min)
      .def_readonly("max", &ErrorStatistics::max)
      .def_readonly("sse", &ErrorStatistics::sse, "sum of squares");
  m.def(
      "error_statistics", [](const FloatArray& errors) { return loc::error_statistics(values_view(errors, "errors")); },
      py::arg("errors"), "Of float64 errors (N,). ValueError when empty or not finite.");
}

void bind_trajectory_errors(py::module_& m) {
  py::class_<Association>(m, "Association", "Pairs of poses by time; both trajectories have the same length.")
      .def_readonly("estimate", &Association::estimate)
      .def_readonly("reference", &Association::reference)
      .def_property_readonly("estimate_index", [](const Association& a) { return indices(a.estimate_index); })
      .def_property_readonly("reference_index", [](const Association& a) { return indices(a.reference_index); })
      .def_readonly("without_partner", &Association::without_partner, "samples left out: nothing near in time")
      .def_readonly("shared_partner", &Association::shared_partner, "left out: the partner had a nearer one");
  const loc::AssociationOptions defaults;
  m.def(
      "associate",
      [](const Trajectory& estimate, const Trajectory& reference, loc::TimeNs max_difference_ns,
         loc::TimeNs estimate_time_offset_ns, bool interpolate_reference, bool one_to_one) {
        return loc::associate(estimate, reference,
                              {.max_difference_ns = max_difference_ns,
                               .estimate_time_offset_ns = estimate_time_offset_ns,
                               .interpolate_reference = interpolate_reference,
                               .one_to_one = one_to_one});
      },
      py::arg("estimate"), py::arg("reference"), py::kw_only(),
      py::arg("max_difference_ns") = defaults.max_difference_ns,
      py::arg("estimate_time_offset_ns") = defaults.estimate_time_offset_ns,
      py::arg("interpolate_reference") = defaults.interpolate_reference, py::arg("one_to_one") = defaults.one_to_one,
      "Pairs each pose of the shorter trajectory with the nearest in time of the other. DataError when nothing pairs.");

  py::class_<AbsoluteError>(m, "AbsoluteError", "Absolute trajectory error, after the alignment.")
      .def_readonly("alignment", &AbsoluteError::alignment)
      .def_property_readonly("times_ns", [](const AbsoluteError& e) { return copied(e.times_ns); })
      .def_property_readonly(
          "translation_m", [](const AbsoluteError& e) { return copied(e.translation_m); }, "(N,) [m]")
      .def_property_readonly(
          "rotation_rad", [](const AbsoluteError& e) { return copied(e.rotation_rad); }, "(N,) [rad]")
      .def_readonly("translation", &AbsoluteError::translation, "[m]; its rmse is the ATE")
      .def_readonly("rotation", &AbsoluteError::rotation, "[rad]");
  m.def(
      "absolute_error",
      [](const Trajectory& estimate, const Trajectory& reference, const std::string& alignment) {
        return loc::absolute_error(estimate, reference, parse_mode(alignment));
      },
      py::arg("estimate"), py::arg("reference"), py::arg("alignment") = "se3",
      "Of paired trajectories (see associate). alignment: \"se3\", \"sim3\", \"yaw\" or \"none\". DataError when the "
      "poses do not determine it.");

  py::class_<RelativeError>(m, "RelativeError", "Relative pose error: drift over pieces of the trajectory.")
      .def_property_readonly(
          "first", [](const RelativeError& e) { return indices(e.first); }, "index of the pose where a piece begins")
      .def_property_readonly("last", [](const RelativeError& e) { return indices(e.last); })
      .def_property_readonly(
          "translation_m", [](const RelativeError& e) { return copied(e.translation_m); }, "(N,) [m]")
      .def_property_readonly(
          "rotation_rad", [](const RelativeError& e) { return copied(e.rotation_rad); }, "(N,) [rad]")
      .def_readonly("translation", &RelativeError::translation, "[m]")
      .def_readonly("rotation", &RelativeError::rotation, "[rad]");
  m.def(
      "relative_error",
      [](const Trajectory& estimate, const Trajectory& reference, double delta, const std::string& unit, bool all_pairs,
         double relative_tolerance, bool pairs_from_reference) {
        return loc::relative_error(estimate, reference,
                                   {.delta = delta,
                                    .unit = parse_unit(unit),
                                    .all_pairs = all_pairs,
                                    .relative_tolerance = relative_tolerance,
                                    .pairs_from_reference = pairs_from_reference});
      },
      py::arg("estimate"), py::arg("reference"), py::kw_only(), py::arg("delta") = 1.0, py::arg("unit") = "frames",
      py::arg("all_pairs") = false, py::arg("relative_tolerance") = 0.1, py::arg("pairs_from_reference") = false,
      "Of paired trajectories, over pieces of length delta: \"frames\", \"seconds\" or \"metres\".");
}

void bind_orientation_error(py::module_& m) {
  py::class_<OrientationError>(m, "OrientationError",
                               "Error of orientations as the BROAD data set defines it; NaN where one is not finite.")
      .def_property_readonly(
          "total", [](const OrientationError& e) { return copied(e.total); }, "(N,) [rad]")
      .def_property_readonly(
          "heading", [](const OrientationError& e) { return copied(e.heading); }, "(N,) [rad], about world's z")
      .def_property_readonly(
          "inclination", [](const OrientationError& e) { return copied(e.inclination); }, "(N,) [rad]")
      .def_readonly("total_rmse", &OrientationError::total_rmse, "[rad], of the scored samples")
      .def_readonly("heading_rmse", &OrientationError::heading_rmse, "[rad]")
      .def_readonly("inclination_rmse", &OrientationError::inclination_rmse, "[rad]")
      .def_readonly("heading_offset", &OrientationError::heading_offset,
                    "[rad] that align_heading removed from the estimate")
      .def_readonly("scored", &OrientationError::scored, "samples in the RMSE")
      .def_readonly("masked", &OrientationError::masked, "left out: outside the mask")
      .def_readonly("estimate_not_finite", &OrientationError::estimate_not_finite, "left out")
      .def_readonly("reference_not_finite", &OrientationError::reference_not_finite, "left out");
  m.def(
      "orientation_error",
      [](const FloatArray& estimate, const FloatArray& reference, const std::optional<BoolArray>& mask,
         bool align_heading) {
        const auto e = rows_view<4>(estimate, "estimate_wxyz");
        const auto r = rows_view<4>(reference, "reference_wxyz", e.rows(), "estimate_wxyz");
        std::span<const std::uint8_t> scored;
        if (mask) {
          scored = mask_view(*mask, "mask");
          require_rows(static_cast<py::ssize_t>(scored.size()), "mask", e.rows(), "estimate_wxyz");
        }
        return loc::orientation_error(quaternions(e), quaternions(r), scored, {.align_heading = align_heading});
      },
      py::arg("estimate_wxyz"), py::arg("reference_wxyz"), py::arg("mask") = py::none(), py::kw_only(),
      py::arg("align_heading") = false,
      "float64 (N, 4) of the same times, NaN where unknown; mask: bool (N,), where to score. align_heading removes the "
      "turn about z that they have in common: for a heading that is relative to the start. DataError when nothing is "
      "left to score.");
}

void bind_consistency(py::module_& m) {
  py::class_<loc::Consistency>(m, "Consistency", "Average of NEES or NIS against its bounds.")
      .def_readonly("average", &loc::Consistency::average, "its expectation is dof")
      .def_readonly("lower", &loc::Consistency::lower)
      .def_readonly("upper", &loc::Consistency::upper)
      .def_readonly("dof", &loc::Consistency::dof)
      .def_readonly("samples", &loc::Consistency::samples)
      .def_property_readonly("optimistic", &loc::Consistency::optimistic, "the covariance is too small")
      .def_property_readonly("pessimistic", &loc::Consistency::pessimistic, "the covariance is too large")
      .def_property_readonly("consistent", &loc::Consistency::consistent);
  m.def(
      "normalised_error_squared",
      [](const ArrayLike& error, const ArrayLike& covariance) {
        const py::array_t<double> e = numbers(error, "error");
        if (e.ndim() != 1) throw py::value_error("error must have shape (d,)");
        return loc::normalised_error_squared(matrix(error, "error", e.shape(0), 1),
                                             matrix(covariance, "covariance", e.shape(0), e.shape(0)));
      },
      py::arg("error"), py::arg("covariance"),
      "e^T P^-1 e (NEES, NIS) of error (d,) and covariance (d, d). ValueError unless P is symmetric and positive "
      "definite.");
  m.def(
      "average_consistency",
      [](const FloatArray& values, int dof, double probability) {
        return loc::average_consistency(values_view(values, "values"), dof, probability);
      },
      py::arg("values"), py::arg("dof"), py::arg("probability") = 0.95,
      "Average of independent values (N,) of NEES or NIS against the bounds of a consistent estimator.");
}

}  // namespace

void bind_eval(py::module_& m) {
  bind_trajectory(m);
  bind_alignment(m);
  bind_statistics(m);
  bind_trajectory_errors(m);
  bind_orientation_error(m);
  bind_consistency(m);
}

}  // namespace locpy
