// Cameras: projection (geometry/camera), scenes, simulated features and pictures (sim/), tracks and points (io/).
#include "libloc/geometry/camera.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <variant>

#include "arrays.hpp"
#include "bindings.hpp"
#include "columns.hpp"
#include "fields.hpp"
#include "libloc/io/points.hpp"
#include "libloc/io/tracks.hpp"
#include "libloc/sim/calibration_target.hpp"
#include "libloc/sim/camera.hpp"
#include "libloc/sim/room.hpp"
#include "libloc/sim/scene.hpp"
#include "libloc/sim/scene_renderer.hpp"
#include "libloc/sim/street.hpp"
#include "recording.hpp"

namespace locpy {
namespace {

namespace fs = std::filesystem;
using loc::Camera;
using loc::CameraCalibration;
using loc::CameraModel;
using loc::Pose3;
using loc::Random;
using loc::Scene;
using loc::SceneRenderer;
using loc::StreetModel;

using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// (N, 3) that may come as lists.
Points points_of(const ArrayLike& object, const char* name) {
  const py::array_t<double> array = numbers(object, name);
  if (array.ndim() != 2 || array.shape(1) != 3) {
    throw py::value_error(std::string(name) + " must have shape (N, 3), has " +
                          py::str(py::tuple(array.attr("shape"))).cast<std::string>());
  }
  return Eigen::Map<const Points>(array.data(), array.shape(0), 3);
}

// ---- geometry

py::array_t<double> project(const Camera& camera, const FloatArray& points) {
  const Rows<3> in = rows_view<3>(points, "points");
  py::array_t<double> out({in.rows(), Eigen::Index{2}});
  MutableRows<2> pixels(out.mutable_data(), in.rows(), 2);
  for (Eigen::Index i = 0; i < in.rows(); ++i) {
    const auto pixel = camera.project(in.row(i).transpose());
    pixels.row(i) = pixel.value_or(Eigen::Vector2d::Constant(std::nan(""))).transpose();
  }
  return out;
}

py::tuple project_with_jacobians(const Camera& camera, const FloatArray& points) {
  const Rows<3> in = rows_view<3>(points, "points");
  const py::ssize_t n = in.rows();
  py::array_t<double> pixels({n, py::ssize_t{2}});
  py::array_t<double> d_point({n, py::ssize_t{2}, py::ssize_t{3}});
  py::array_t<double> d_parameters({n, py::ssize_t{2}, py::ssize_t{8}});
  for (py::ssize_t i = 0; i < n; ++i) {
    const auto p = camera.project_with_jacobians(in.row(i).transpose());
    for (int row = 0; row < 2; ++row) {
      pixels.mutable_at(i, row) = p ? p->pixel_px[row] : std::nan("");
      for (int k = 0; k < 3; ++k) d_point.mutable_at(i, row, k) = p ? p->d_point(row, k) : std::nan("");
      for (int k = 0; k < 8; ++k) d_parameters.mutable_at(i, row, k) = p ? p->d_parameters(row, k) : std::nan("");
    }
  }
  return py::make_tuple(pixels, d_point, d_parameters);
}

py::array_t<double> unproject(const Camera& camera, const FloatArray& pixels) {
  const Rows<2> in = rows_view<2>(pixels, "pixels");
  py::array_t<double> out({in.rows(), Eigen::Index{3}});
  MutableRows<3> rays(out.mutable_data(), in.rows(), 3);
  for (Eigen::Index i = 0; i < in.rows(); ++i) {
    const auto ray = camera.unproject(in.row(i).transpose());
    rays.row(i) = ray.value_or(Eigen::Vector3d::Constant(std::nan(""))).transpose();
  }
  return out;
}

void bind_projection(py::module_& m) {
  py::class_<Camera>(
      m, "Camera",
      "Projection of a calibrated camera. Points are in its axes (x right, y down, z forward) [m]; pixel "
      "(0, 0) is the centre of the top-left one. Rows without an answer are NaN: behind the camera, or "
      "outside the radius at which the distortion folds back.")
      .def(py::init<const CameraCalibration&>(), py::arg("calibration"))
      .def("project", &project, py::arg("points"), "Points (N, 3) to pixels (N, 2).")
      .def(
          "project_with_jacobians", &project_with_jacobians, py::arg("points"),
          "(pixels (N, 2), their derivatives by the point (N, 2, 3), and by fx fy cx cy and the distortion (N, 2, 8)).")
      .def("unproject", &unproject, py::arg("pixels"), "Pixels (N, 2) to unit vectors (N, 3).")
      .def(
          "in_image",
          [](const Camera& self, const FloatArray& pixels, double border_px) {
            const Rows<2> in = rows_view<2>(pixels, "pixels");
            py::array_t<bool> out(in.rows());
            for (Eigen::Index i = 0; i < in.rows(); ++i) {
              out.mutable_data()[i] = self.in_image(in.row(i).transpose(), border_px);
            }
            return out;
          },
          py::arg("pixels"), py::arg("border_px") = 0.0, "bool (N,): at least so far from the image's border.")
      .def_property_readonly("max_angle", &Camera::max_angle, "Of a ray to the optical axis [rad].");
}

// ---- scenes

void bind_scenes(py::module_& m) {
  py::class_<Scene>(m, "Scene", "What a simulated camera looks at: points, and textured faces for pictures of them.")
      .def(py::init([](const ArrayLike& points) {
             const Points in = points_of(points, "points");
             std::vector<Eigen::Vector3d> list;
             for (Eigen::Index i = 0; i < in.rows(); ++i) list.emplace_back(in.row(i).transpose());
             return Scene::of_points(list);
           }),
           py::arg("points"), "Points (N, 3) in world [m], seen from everywhere.")
      .def_property_readonly(
          "points", [](const Scene& self) { return rows<3>(self.points, [](const auto& p) { return p.position; }); },
          "(N, 3) in world [m]; the row is the identity of a feature")
      .def_property_readonly(
          "faces", [](const Scene& self) { return self.faces.size(); }, "how many")
      .def(
          "add",
          [](Scene& self, const Scene& other, const std::optional<Pose3>& T_world_other) {
            return self.add(other, T_world_other.value_or(Pose3{}));
          },
          py::arg("other"), py::arg("T_world_other") = py::none(),
          "Adds another scene, moved. Returns the row of its first point.")
      .def(
          "visible_from",
          [](const Scene& self, const ArrayLike& eye) {
            const loc::SightLines sight(self, vector3(eye, "eye"), std::numeric_limits<double>::infinity());
            return column<bool>(self.points, [&](const loc::ScenePoint& p) { return sight.reach(p); });
          },
          py::arg("eye"), "bool (N,): the points that no face hides from a place (3,).");

  m.def(
      "box_room",
      [](const Random& random, const ArrayLike& size, double cell) {
        return loc::box_room({.size_m = vector3(size, "size_m"), .cell_m = cell}, random);
      },
      py::arg("random"), py::kw_only(), py::arg("size_m") = py::make_tuple(8.0, 6.0, 3.0), py::arg("cell_m") = 0.5,
      "A room seen from inside, origin in the middle of its floor; one feature in each cell of its walls.");

  using S = StreetModel;
  py::class_<S>(m, "StreetModel", "Measures of a street [m]; every field is a keyword: StreetModel(road_width_m=6).")
      .def(py::init([](const py::kwargs& fields) { return with_fields<S>("StreetModel", fields); }))
      .def_readwrite("road_width_m", &S::road_width_m)
      .def_readwrite("pavement_m", &S::pavement_m, "between road and facades")
      .def_readwrite("min_facade_m", &S::min_facade_m)
      .def_readwrite("max_facade_m", &S::max_facade_m)
      .def_readwrite("min_height_m", &S::min_height_m)
      .def_readwrite("max_height_m", &S::max_height_m)
      .def_readwrite("largest_gap_m", &S::largest_gap_m, "between houses")
      .def_readwrite("window_m", &S::window_m, "distance of windows, about; four features each")
      .def_readwrite("extend_m", &S::extend_m, "straight on before and beyond the path")
      .def_readwrite("kinds", &S::kinds, "different houses");
  m.def(
      "street",
      [](const ArrayLike& path, const Random& random, const std::optional<StreetModel>& model) {
        const Points in = points_of(path, "path");
        std::vector<Eigen::Vector3d> list;
        for (Eigen::Index i = 0; i < in.rows(); ++i) list.emplace_back(in.row(i).transpose());
        return loc::street(list, model.value_or(StreetModel{}), random);
      },
      py::arg("path"), py::arg("random"), py::arg("model") = py::none(),
      "Facades on both sides of a path (N, 3) on the ground [m], and the road.");
  m.def(
      "sampled_path",
      [](const loc::Motion& motion, double spacing, double height) {
        return rows<3>(loc::sampled_path(motion, spacing, height), [](const auto& p) { return p; });
      },
      py::arg("motion"), py::arg("spacing_m") = 1.0, py::arg("height_m") = 0.0,
      "Where a motion goes, for street(): (N, 3), all at one height.");
  m.def(
      "checkerboard",
      [](int columns, int count, double square) {
        return loc::checkerboard({columns, count, square});
      },
      py::kw_only(), py::arg("columns") = 9, py::arg("rows") = 6, py::arg("square_m") = 0.04,
      "Points are the inner corners: row * columns + column. Target: x right, y up, z out of the board.");
  const loc::AprilGridModel grid;
  m.def(
      "april_grid",
      [](int columns, int count, double tag, double spacing, int first, bool squares) {
        return loc::april_grid({columns, count, tag, spacing, first, squares});
      },
      py::kw_only(), py::arg("columns") = grid.columns, py::arg("rows") = grid.rows, py::arg("tag_m") = grid.tag_m,
      py::arg("spacing") = grid.spacing, py::arg("first_tag") = grid.first_tag,
      py::arg("corner_squares") = grid.corner_squares,
      "Kalibr's board of tags 36h11. Points are the tags' corners: 4 * tag + corner, lower left first, against the "
      "clock.");
}

// ---- simulated camera

/// All frames of a simulated camera as arrays; of the features of all frames, one after the other.
struct CameraRun {
  py::array_t<std::int64_t> time_ns;
  py::array_t<double> true_time_s, position, q_wxyz;
  py::array_t<std::int64_t> frame, feature, point;
  py::array_t<double> pixel, true_pixel, depth;
  py::array_t<bool> outlier, wrong_id;
};

CameraRun run_camera(const loc::Motion& motion, const CameraCalibration& calibration, const Scene& scene,
                     const Random& random, const CameraModel& model, double duration_s) {
  std::vector<loc::SimulatedFrame> frames;
  {
    const py::gil_scoped_release release;
    frames = loc::simulate_camera(motion, model, calibration, scene, random, duration_s);
  }
  std::vector<std::int64_t> number;
  std::vector<loc::FeatureObservation> features;
  std::vector<loc::ObservationTruth> truth;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto& seen = frames[i].measurement.features;
    number.insert(number.end(), seen.size(), static_cast<std::int64_t>(i));
    features.insert(features.end(), seen.begin(), seen.end());
    truth.insert(truth.end(), frames[i].truth.begin(), frames[i].truth.end());
  }
  using F = loc::SimulatedFrame;
  using O = loc::FeatureObservation;
  using T = loc::ObservationTruth;
  CameraRun run;
  run.time_ns = column<std::int64_t>(frames, [](const F& f) { return f.measurement.time_ns; });
  run.true_time_s = column<double>(frames, [](const F& f) { return f.time_s; });
  run.position = rows<3>(frames, [](const F& f) { return f.T_world_camera.translation; });
  run.q_wxyz = rows<4>(frames, [](const F& f) {
    const Eigen::Quaterniond& q = f.T_world_camera.rotation;
    return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  });
  run.frame = column<std::int64_t>(number, [](std::int64_t i) { return i; });
  run.feature = column<std::int64_t>(features, [](const O& o) { return o.id; });
  run.pixel = rows<2>(features, [](const O& o) { return o.pixel_px; });
  run.point = column<std::int64_t>(truth, [](const T& t) { return t.point; });
  run.true_pixel = rows<2>(truth, [](const T& t) { return t.pixel_px; });
  run.depth = column<double>(truth, [](const T& t) { return t.depth_m; });
  run.outlier = column<bool>(truth, [](const T& t) { return t.outlier; });
  run.wrong_id = column<bool>(truth, [](const T& t) { return t.wrong_id; });
  return run;
}

void bind_simulation(py::module_& m) {
  using C = CameraModel;
  py::class_<C>(m, "CameraModel",
                "A simulated camera with its feature tracker; every field is a keyword: CameraModel(sigma_px=0.3).")
      .def(py::init([](const py::kwargs& fields) { return with_fields<C>("CameraModel", fields); }))
      .def_readwrite("rate_hz", &C::rate_hz)
      .def_readwrite("start_time_ns", &C::start_time_ns, "time 0 of the motion on the IMU's clock")
      .def_readwrite("stamp_jitter_s", &C::stamp_jitter_s)
      .def_readwrite("sigma_px", &C::sigma_px, "white noise of each coordinate")
      .def_readwrite("border_px", &C::border_px, "no features nearer to the image's border")
      .def_readwrite("min_depth_m", &C::min_depth_m)
      .def_readwrite("max_depth_m", &C::max_depth_m)
      .def_readwrite("occlusion", &C::occlusion, "faces hide what is behind them")
      .def_readwrite("max_features", &C::max_features, "0: no limit")
      .def_readwrite("min_separation_px", &C::min_separation_px, "of a new feature from the others")
      .def_readwrite("outlier_rate", &C::outlier_rate, "share that is anywhere in the image")
      .def_readwrite("wrong_id_rate", &C::wrong_id_rate, "share that changed identities with another one")
      .def_readwrite("loss_rate", &C::loss_rate, "probability of losing a track in view, per frame")
      .def_readwrite("reappear_rate", &C::reappear_rate, "probability of finding a lost one in view, per frame")
      .def_readwrite("new_id_rate", &C::new_id_rate, "share of found ones that get a new identity")
      .def("check", &C::check, "ValueError names a field that is out of range.");
  py::class_<CameraRun>(m, "CameraRun", "F frames of a simulated camera, and the M features of all of them in order.")
      .def_readonly("time_ns", &CameraRun::time_ns, "(F,) stamps, on the camera's clock")
      .def_readonly("true_time_s", &CameraRun::true_time_s, "(F,) since the start of the motion")
      .def_readonly("position", &CameraRun::position, "(F, 3) of camera in world [m]")
      .def_readonly("q_world_camera_wxyz", &CameraRun::q_wxyz, "(F, 4)")
      .def_readonly("frame", &CameraRun::frame, "(M,) index of the frame")
      .def_readonly("feature", &CameraRun::feature, "(M,) measured identity")
      .def_readonly("pixel_px", &CameraRun::pixel, "(M, 2) measured, u and v")
      .def_readonly("point", &CameraRun::point, "(M,) truth: row of the scene's points")
      .def_readonly("true_pixel_px", &CameraRun::true_pixel, "(M, 2)")
      .def_readonly("depth_m", &CameraRun::depth, "(M,) along the optical axis")
      .def_readonly("outlier", &CameraRun::outlier, "(M,) bool")
      .def_readonly("wrong_id", &CameraRun::wrong_id, "(M,) bool");
  m.def(
      "simulate_camera",
      [](const loc::Motion& motion, const CameraCalibration& calibration, const Scene& scene, const Random& random,
         const std::optional<CameraModel>& model, std::optional<double> duration) {
        return run_camera(motion, calibration, scene, random, model.value_or(CameraModel{}),
                          duration.value_or(loc::kUnknown));
      },
      py::arg("motion"), py::arg("calibration"), py::arg("scene"), py::arg("random"), py::arg("model") = py::none(),
      py::arg("duration_s") = py::none(),
      "What a camera on a moving body sees of a scene, with the truth. The calibration is the true one; its "
      "time_offset_s "
      "is how much the stamps are early.");
}

// ---- pictures

loc::PixelFormat pixel_format(const std::string& name) {
  if (name == "grey") return loc::PixelFormat::kGray;
  if (name == "bgr") return loc::PixelFormat::kBgr;
  if (name == "rgb") return loc::PixelFormat::kRgb;
  throw py::value_error("format = '" + name + "': must be 'grey', 'bgr' or 'rgb'");
}

void bind_renderer(py::module_& m) {
  const loc::RendererOptions d;
  py::class_<SceneRenderer>(m, "SceneRenderer", "Pictures of a scene as a calibrated camera takes them.")
      .def(py::init([](const Scene& scene, const CameraCalibration& calibration, const std::string& format,
                       double texel, double blur, double gain, double noise) {
             return SceneRenderer(scene, calibration, {pixel_format(format), texel, blur, gain, noise});
           }),
           py::arg("scene"), py::arg("calibration"), py::kw_only(), py::arg("format") = "grey",
           py::arg("texel_m") = d.texel_m, py::arg("blur_px") = d.blur_px, py::arg("gain") = d.gain,
           py::arg("noise_sigma") = d.noise_sigma)
      .def(
          "render",
          [](const SceneRenderer& self, const std::variant<Pose3, std::vector<Pose3>>& poses, Random* random) {
            const auto* one = std::get_if<Pose3>(&poses);
            const std::span<const Pose3> all =
                one != nullptr ? std::span(one, 1) : std::span<const Pose3>(std::get<std::vector<Pose3>>(poses));
            const loc::ImageMeasurement image = self.render(all, random);
            std::vector<py::ssize_t> shape{image.height_px, image.width_px};
            if (image.format != loc::PixelFormat::kGray) shape.push_back(3);
            py::array_t<std::uint8_t> out(shape);
            std::ranges::copy(*image.data, out.mutable_data());
            return out;
          },
          py::arg("T_world_camera"), py::arg("random") = py::none(),
          "uint8 (height, width) or (height, width, 3). Several poses: their mean, as motion blur.");
}

// ---- files

void bind_files(py::module_& m) {
  m.def(
      "read_points",
      [](const fs::path& path) {
        const loc::PointsFile file = loc::read_points(path);
        return std::pair(rows<3>(file.points, [](const auto& p) { return p; }), as_map(file.counts));
      },
      py::arg("path"), "Points (N, 3) from a text file with x y z a line, and what was read and skipped.");
  m.def(
      "write_points",
      [](const fs::path& path, const ArrayLike& points) {
        const Points in = points_of(points, "points");
        std::vector<Eigen::Vector3d> list;
        for (Eigen::Index i = 0; i < in.rows(); ++i) list.emplace_back(in.row(i).transpose());
        loc::write_points(path, list);
      },
      py::arg("path"), py::arg("points"));
  m.def(
      "read_tracks",
      [](const fs::path& path) {
        const loc::TracksFile file = loc::read_tracks(path);
        std::vector<std::int64_t> frame;
        std::vector<loc::FeatureObservation> features;
        for (const loc::TrackFrame& f : file.frames) {
          frame.insert(frame.end(), f.features.size(), f.frame);
          features.insert(features.end(), f.features.begin(), f.features.end());
        }
        return py::make_tuple(column<std::int64_t>(frame, [](std::int64_t i) { return i; }),
                              column<std::int64_t>(features, [](const auto& o) { return o.id; }),
                              rows<2>(features, [](const auto& o) { return o.pixel_px; }), as_map(file.counts));
      },
      py::arg("path"),
      "A tracks file (rows `frame feature dimension value`): frame (M,), feature (M,), pixel_px (M, 2), and what was "
      "read "
      "and skipped. DataError names file, line and value.");
  m.def(
      "write_tracks",
      [](const fs::path& path, const TimeArray& frame, const TimeArray& feature, const FloatArray& pixel) {
        const auto frames = times_view(frame, "frame");
        const auto features = times_view(feature, "feature");
        const auto n = static_cast<py::ssize_t>(frames.size());
        require_rows(static_cast<py::ssize_t>(features.size()), "feature", n, "frame");
        const Rows<2> pixels = rows_view<2>(pixel, "pixel_px", n, "frame");
        std::vector<loc::TrackFrame> list;
        for (py::ssize_t i = 0; i < n; ++i) {
          const auto k = static_cast<std::size_t>(i);
          if (list.empty() || list.back().frame != frames[k]) list.push_back({frames[k], {}});
          list.back().features.push_back({features[k], pixels.row(i).transpose()});
        }
        loc::write_tracks(path, list);
      },
      py::arg("path"), py::arg("frame"), py::arg("feature"), py::arg("pixel_px"),
      "Writes a tracks file from arrays (M,), (M,), (M, 2); frames must ascend.");
}

}  // namespace

void bind_camera(py::module_& m) {
  bind_projection(m);
  bind_scenes(m);
  bind_simulation(m);
  bind_renderer(m);
  bind_files(m);
}

}  // namespace locpy
