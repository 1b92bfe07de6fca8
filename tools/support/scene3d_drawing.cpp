#include "tools/support/scene3d_drawing.hpp"

#include <mrpt/img/CImage.h>
#include <mrpt/opengl/CEllipsoid3D.h>
#include <mrpt/opengl/CEllipsoidInverseDepth3D.h>
#include <mrpt/opengl/CFBORender.h>
#include <mrpt/opengl/CFrustum.h>
#include <mrpt/opengl/COpenGLScene.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/poses/CPose3D.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libloc/core/check.hpp"
#include "libloc/geometry/inverse_depth.hpp"

namespace loc {
namespace {

using mrpt::img::TColor;
using mrpt::opengl::COpenGLScene;
using mrpt::opengl::CPointCloudColoured;
using mrpt::opengl::CSetOfLines;

const TColor kBackground(250, 250, 250);
const TColor kTrajectory(31, 90, 200);
const TColor kDoubtful(220, 30, 30);
const TColor kReference(30, 150, 60);
const TColor kGps(240, 140, 0);
const TColor kPointUsed(170, 30, 150);
const TColor kPoint(120, 120, 130);
const TColor kGrid(215, 215, 215);
const TColor kCamera(20, 20, 20);
const TColor kText(40, 40, 40);
constexpr double kSigmas = 3;
constexpr double kTracePerView = 1.0 / 700;  // distance between the dots of a track, of what the view spans
constexpr double kMaxDots = 20'000;          // of a track

mrpt::math::TPoint3D point_of(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

mrpt::poses::CPose3D pose_of(const Pose3& pose) {
  return mrpt::poses::CPose3D(mrpt::math::CMatrixDouble44(pose.matrix()));
}

void add_dot(CPointCloudColoured& cloud, const Eigen::Vector3d& p, const TColor& c) {
  constexpr float kFull = 255;
  cloud.push_back(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
                  static_cast<float>(c.R) / kFull, static_cast<float>(c.G) / kFull, static_cast<float>(c.B) / kFull, 1);
}

// Lines are one pixel wide everywhere: a track is a row of dots that touch.
void draw_track(CPointCloudColoured& cloud, const std::vector<TrackPoint>& track, const TColor& colour,
                double least_spacing) {
  double length = 0;
  for (std::size_t i = 1; i < track.size(); ++i) {
    if (!track[i].begins) length += (track[i].position - track[i - 1].position).norm();
  }
  const double spacing = std::max(least_spacing, length / kMaxDots);
  for (std::size_t i = 0; i < track.size(); ++i) {
    const TColor& c = track[i].doubtful ? kDoubtful : colour;
    if (i > 0 && !track[i].begins) {
      const Eigen::Vector3d step = track[i].position - track[i - 1].position;
      const double pieces = std::ceil(step.norm() / spacing);
      for (double k = 1; k < pieces; ++k) add_dot(cloud, track[i - 1].position + k / pieces * step, c);
    }
    add_dot(cloud, track[i].position, c);
  }
}

// MRPT draws no ellipsoid whose covariance has a determinant below 1e-20: the covariance is taken in another unit.
template <class Ellipsoid>
void set_ellipsoid(Ellipsoid& object, const Eigen::Matrix3d& covariance, const Eigen::Vector3d& mean, double unit) {
  mrpt::math::CMatrixDouble33 c;
  mrpt::math::CMatrixFixed<double, 3, 1> m;
  for (int i = 0; i < 3; ++i) {
    m[i] = mean[i];
    for (int j = 0; j < 3; ++j) c(i, j) = covariance(i, j);
  }
  object.setScale(static_cast<float>(unit));
  object.setCovMatrixAndMean(c, m);
  object.setQuantiles(static_cast<float>(kSigmas));
}

// Positive definite, no variance below 1e-8 of the largest, so that it can be drawn; nullopt when nothing can.
std::optional<Eigen::Matrix3d> drawable(const Eigen::Matrix3d& covariance) {
  if (!covariance.allFinite()) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes((covariance + covariance.transpose()) / 2);
  const double most = axes.eigenvalues().maxCoeff();
  if (!(most > 0)) return std::nullopt;
  const Eigen::Vector3d values = axes.eigenvalues().cwiseMax(1e-8 * most);
  return axes.eigenvectors() * values.asDiagonal() * axes.eigenvectors().transpose();
}

mrpt::img::CImage picture_of(const ImageMeasurement& image, const std::vector<SlamFeature>& features) {
  mrpt::img::CImage out(static_cast<unsigned>(image.width_px), static_cast<unsigned>(image.height_px),
                        mrpt::img::CH_RGB);
  for (std::int32_t row = 0; row < image.height_px; ++row) {
    const std::uint8_t* from = image.data->data() + static_cast<std::ptrdiff_t>(row) * image.row_stride_bytes;
    std::copy_n(from, 3 * image.width_px, out.ptrLine<std::uint8_t>(static_cast<unsigned>(row)));
  }
  const auto near_image = [&](const Eigen::Vector2d& p) {
    return p.allFinite() && std::abs(p.x()) < 1e5 && std::abs(p.y()) < 1e5;
  };
  for (const SlamFeature& f : features) {
    const TColor colour = f.state == SlamFeatureState::kRejected    ? TColor(255, 40, 40)
                          : f.state == SlamFeatureState::kPredicted ? TColor(90, 160, 255)
                          : f.state == SlamFeatureState::kNew       ? TColor(255, 230, 0)
                                                                    : TColor(60, 255, 60);
    if (near_image(f.predicted_px) && f.innovation_cov.allFinite() && f.innovation_cov.trace() < 1e5 &&
        f.innovation_cov.determinant() > 0) {
      mrpt::math::CMatrixDouble22 c;
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) c(i, j) = f.innovation_cov(i, j);
      }
      out.ellipseGaussian(c, f.predicted_px.x(), f.predicted_px.y(), kSigmas, colour, 1, 16);
    }
    if (!near_image(f.pixel_px)) continue;
    out.drawCircle(static_cast<int>(std::lround(f.pixel_px.x())), static_cast<int>(std::lround(f.pixel_px.y())), 5,
                   colour, 2);
  }
  return out;
}

}  // namespace

struct SceneDrawing::Parts {
  COpenGLScene::Ptr scene = COpenGLScene::Create();
  CSetOfLines::Ptr grid = CSetOfLines::Create();
  CPointCloudColoured::Ptr tracks = CPointCloudColoured::Create();
  CPointCloudColoured::Ptr fixes = CPointCloudColoured::Create();
  CPointCloudColoured::Ptr points = CPointCloudColoured::Create();
  CSetOfLines::Ptr axes[3] = {CSetOfLines::Create(), CSetOfLines::Create(), CSetOfLines::Create()};
  mrpt::opengl::CEllipsoid3D::Ptr body = mrpt::opengl::CEllipsoid3D::Create();
  mrpt::opengl::CFrustum::Ptr frustum = mrpt::opengl::CFrustum::Create();
  std::vector<mrpt::opengl::CEllipsoid3D::Ptr> ellipsoids;
  std::vector<mrpt::opengl::CEllipsoidInverseDepth3D::Ptr> inverse_depths;
  mrpt::opengl::COpenGLViewport::Ptr picture;

  void draw_grid(const Scene3d& scene_data, const SceneEye& eye, double span, double* square);
  void draw_body(const Scene3d& scene_data, double size);
  void draw_points(const Scene3d& scene_data);
  void draw_picture(const Scene3d& scene_data, int width_px, int height_px);
  void write(const Scene3d& scene_data, double square);
};

SceneDrawing::SceneDrawing() : parts_(std::make_unique<Parts>()) {
  Parts& p = *parts_;
  const auto view = p.scene->getViewport("main");
  view->setCustomBackgroundColor(mrpt::img::TColorf(kBackground));
  view->lightParameters().ambient = {0.6F, 0.6F, 0.6F, 1.0F};
  p.grid->setColor_u8(kGrid);
  p.tracks->setPointSize(4);
  p.fixes->setPointSize(5);
  p.points->setPointSize(5);
  for (const auto& cloud : {p.tracks, p.fixes, p.points}) cloud->enableVariablePointSize(false);
  p.axes[0]->setColor_u8(TColor(220, 0, 0));
  p.axes[1]->setColor_u8(TColor(0, 160, 0));
  p.axes[2]->setColor_u8(TColor(0, 0, 220));
  p.frustum->setColor_u8(kCamera);
  p.body->setColor_u8(kTrajectory);
  p.body->setNumberOfSegments(12);
  p.scene->insert(p.grid);
  p.scene->insert(p.tracks);
  p.scene->insert(p.fixes);
  p.scene->insert(p.points);
  for (const auto& axis : p.axes) p.scene->insert(axis);
  p.scene->insert(p.body);
  p.scene->insert(p.frustum);
}

SceneDrawing::~SceneDrawing() = default;

const std::shared_ptr<COpenGLScene>& SceneDrawing::scene() const {
  return parts_->scene;
}

void SceneDrawing::show(const Scene3d& scene, const SceneEye& eye, int width_px, int height_px) {
  Parts& p = *parts_;
  const auto view = p.scene->getViewport("main");
  auto& camera = view->getCamera();
  camera.setProjectiveModel();
  camera.setProjectiveFOVdeg(static_cast<float>(kEyeFieldOfViewDeg));
  camera.setPointingAt(point_of(eye.target));
  camera.setZoomDistance(static_cast<float>(eye.distance));
  camera.setAzimuthDegrees(static_cast<float>(eye.azimuth_deg));
  camera.setElevationDegrees(static_cast<float>(eye.elevation_deg));
  view->setViewportClipDistances(static_cast<float>(eye.distance / 100), static_cast<float>(eye.distance * 100));

  const double span = 2 * eye.distance * std::tan(kEyeFieldOfViewDeg * std::numbers::pi / 360);
  double square = 0;
  p.draw_grid(scene, eye, span, &square);
  p.tracks->clear();
  draw_track(*p.tracks, scene.reference, kReference, span * kTracePerView);
  draw_track(*p.tracks, scene.trajectory, kTrajectory, span * kTracePerView);
  p.fixes->clear();
  for (const Eigen::Vector3d& fix : scene.gps) add_dot(*p.fixes, fix, kGps);
  p.draw_body(scene, span / 20);
  p.draw_points(scene);
  p.draw_picture(scene, width_px, height_px);
  p.write(scene, square);
}

// Below what there is, over what can be seen.
void SceneDrawing::Parts::draw_grid(const Scene3d& data, const SceneEye& eye, double span, double* square) {
  double floor = data.trajectory.empty() ? 0 : data.trajectory.front().position.z();
  for (const TrackPoint& p : data.trajectory) floor = std::min(floor, p.position.z());
  *square = round_length(span / 10);
  const double x = std::round(eye.target.x() / *square) * *square;
  const double y = std::round(eye.target.y() / *square) * *square;
  grid->clear();
  constexpr int kSquares = 12;  // to each side
  for (int i = -kSquares; i <= kSquares; ++i) {
    const double reach = kSquares * *square;
    const double at = i * *square;
    grid->appendLine(x - reach, y + at, floor, x + reach, y + at, floor);
    grid->appendLine(x + at, y - reach, floor, x + at, y + reach, floor);
  }
}

void SceneDrawing::Parts::draw_body(const Scene3d& data, double size) {
  body->setVisibility(false);
  for (int i = 0; i < 3; ++i) {
    axes[i]->clear();
    if (!data.body) continue;
    const Eigen::Vector3d from = data.body->translation;
    const Eigen::Vector3d to = *data.body * (size * Eigen::Vector3d::Unit(i)).eval();
    axes[i]->appendLine(point_of(from), point_of(to));
  }
  if (data.body) {
    if (const auto covariance = drawable(data.position_cov)) {
      const double unit = std::sqrt(covariance->trace());
      set_ellipsoid(*body, *covariance / (unit * unit), Eigen::Vector3d::Zero(), unit);
      body->setLocation(point_of(data.body->translation));
      body->setVisibility(true);
    }
  }
  frustum->setVisibility(data.camera.has_value());
  if (!data.camera) return;
  // MRPT's frustum looks along x, with y to the left and z up.
  Eigen::Matrix3d R_camera_frustum;
  R_camera_frustum << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  const Pose3 turned = data.camera->T_world_camera * Pose3{Eigen::Quaterniond(R_camera_frustum), {0, 0, 0}};
  const auto degrees = [](double tangent) { return static_cast<float>(std::atan(tangent) * 180 / std::numbers::pi); };
  const Eigen::Vector4d& t = data.camera->tangents;
  frustum->setHorzFOVAsymmetric(degrees(t[0]), degrees(t[1]));
  frustum->setVertFOVAsymmetric(degrees(t[3]), degrees(t[2]));
  frustum->setNearFarPlanes(static_cast<float>(size / 100), static_cast<float>(1.5 * size));
  frustum->setPose(pose_of(turned));
}

void SceneDrawing::Parts::draw_points(const Scene3d& data) {
  points->clear();
  std::size_t points_used = 0;
  std::size_t rays_used = 0;
  for (const ScenePoint& p : data.points) {
    const TColor& colour = p.in_use ? kPointUsed : kPoint;
    add_dot(*points, p.position, colour);
    const auto covariance = drawable(p.position_cov);
    if (!covariance) continue;
    const TColor pale(colour.R, colour.G, colour.B, p.in_use ? 110 : 60);
    if (!p.ray) {
      if (points_used == ellipsoids.size()) {
        ellipsoids.push_back(mrpt::opengl::CEllipsoid3D::Create());
        ellipsoids.back()->setNumberOfSegments(8);
        scene->insert(ellipsoids.back());
      }
      auto& object = *ellipsoids[points_used++];
      const double unit = std::sqrt(covariance->trace());
      set_ellipsoid(object, *covariance / (unit * unit), Eigen::Vector3d::Zero(), unit);
      object.setLocation(point_of(p.position));
      object.setColor_u8(pale);
      object.setVisibility(true);
      continue;
    }
    if (rays_used == inverse_depths.size()) {
      inverse_depths.push_back(mrpt::opengl::CEllipsoidInverseDepth3D::Create());
      inverse_depths.back()->setNumberOfSegments(8);
      scene->insert(inverse_depths.back());
    }
    auto& object = *inverse_depths[rays_used++];
    // Parameters of MRPT: inverse range, angle to the left (y) and downwards (-z) of a frame whose x is the ray.
    Eigen::Matrix3d R_world_ray;
    R_world_ray.col(0) = (p.position - p.ray->anchor).normalized();
    R_world_ray.col(1) = R_world_ray.col(0).unitOrthogonal();
    R_world_ray.col(2) = R_world_ray.col(0).cross(R_world_ray.col(1));
    const double rho = p.ray->inverse_depth;
    Eigen::Matrix3d parameters = Eigen::Matrix3d::Zero();
    Eigen::Matrix<double, 2, 3> across;
    across.row(0) = rho * R_world_ray.col(1).transpose();
    across.row(1) = -rho * R_world_ray.col(2).transpose();
    // With the distance's deviation as unit of length, the inverse depth does not vanish beside the angles.
    const double unit = 1 / std::max(p.ray->sigma_inverse_depth, 1e-9 * rho);
    parameters(0, 0) = std::pow(p.ray->sigma_inverse_depth * unit, 2);
    parameters.bottomRightCorner<2, 2>() = across * *covariance * across.transpose();
    const auto shape = drawable(parameters);
    if (!shape) {
      object.setVisibility(false);
      continue;
    }
    set_ellipsoid(object, *shape, {rho * unit, 0, 0}, unit);
    // As far as infinity, within its deviations: drawn to three times the distance.
    object.setUnderflowMaxRange(static_cast<float>(3 / (rho * unit)));
    object.setPose(pose_of({Eigen::Quaterniond(R_world_ray), p.ray->anchor}));
    object.setColor_u8(pale);
    object.setVisibility(true);
  }
  for (std::size_t i = points_used; i < ellipsoids.size(); ++i) ellipsoids[i]->setVisibility(false);
  for (std::size_t i = rays_used; i < inverse_depths.size(); ++i) inverse_depths[i]->setVisibility(false);
}

void SceneDrawing::Parts::draw_picture(const Scene3d& data, int width_px, int height_px) {
  if (!data.picture) return;
  if (!picture) {
    picture = scene->createViewport("picture");
    picture->setBorderSize(1);
    picture->setBorderColor(kCamera);
  }
  const double width = kPictureShare * width_px;
  const double height = width * data.picture->height_px / data.picture->width_px;
  constexpr double kEdge = 10;
  picture->setViewportPosition(1 - (width + kEdge) / width_px, kEdge / height_px, width / width_px, height / height_px);
  picture->setImageView(picture_of(*data.picture, data.features));
}

void SceneDrawing::Parts::write(const Scene3d& data, double square) {
  const auto view = scene->getViewport("main");
  view->clearTextMessages();
  mrpt::opengl::TFontParams font;
  font.vfont_name = "sans";
  font.vfont_scale = 14;
  font.draw_shadow = true;  // over what is behind
  font.shadow_color = mrpt::img::TColorf(kBackground);
  constexpr double kLine = 24;
  double y = -30;
  std::uint32_t index = 0;
  const auto put = [&](const std::string& text, const TColor& colour) {
    font.color = mrpt::img::TColorf(colour);
    view->addTextMessage(14, y, text, index++, font);
    y -= kLine;
  };
  const std::string unit = data.metric ? " m" : " units";
  for (const std::string& line : data.lines) put(line, kText);
  for (const std::string& warning : data.warnings) put("! " + warning, kDoubtful);
  y -= kLine / 2;
  if (!data.trajectory.empty()) put("trajectory", kTrajectory);
  if (!data.reference_note.empty()) put("reference (" + data.reference_note + ")", kReference);
  if (!data.gps_note.empty()) put("GPS (" + data.gps_note + ")", kGps);
  if (!data.points.empty()) put("map: used now, with 3 sigma", kPointUsed);
  if (!data.points.empty()) put("map: the other points", kPoint);
  std::string length = std::to_string(square);
  length.erase(length.find_last_not_of('0') + 1);
  if (length.ends_with('.')) length.pop_back();
  put("grid: " + length + unit, TColor(150, 150, 150));
}

void SceneDrawing::save(const std::filesystem::path& path) const {
  if (!parts_->scene->saveToFile(path.string())) throw DataError(path.string() + ": cannot be written");
}

struct SceneCamera3d::Parts {
  int width_px;
  int height_px;
  mrpt::opengl::CFBORender render;
  mrpt::img::CImage image;

  Parts(int width, int height)
      : width_px(width),
        height_px(height),
        render(static_cast<unsigned>(width), static_cast<unsigned>(height)),
        image(static_cast<unsigned>(width), static_cast<unsigned>(height), mrpt::img::CH_RGB) {}
};

SceneCamera3d::SceneCamera3d(int width_px, int height_px) {
  require(width_px >= 64 && width_px <= 8192, "width_px", width_px, "must be 64 to 8192");
  require(height_px >= 64 && height_px <= 8192, "height_px", height_px, "must be 64 to 8192");
  try {
    parts_ = std::make_unique<Parts>(width_px, height_px);
  } catch (const std::exception& error) {
    throw std::runtime_error("pictures cannot be drawn here: EGL does not work (Debian: libegl1, libgl1-mesa-dri): " +
                             std::string(error.what()));
  }
}

SceneCamera3d::~SceneCamera3d() = default;

ImageMeasurement SceneCamera3d::take(const SceneDrawing& drawing) {
  Parts& p = *parts_;
  p.render.setCamera(*drawing.scene(), drawing.scene()->getViewport("main")->getCamera());
  p.render.render_RGB(*drawing.scene(), p.image);
  auto bytes = std::make_shared<std::vector<std::uint8_t>>();
  bytes->reserve(static_cast<std::size_t>(3 * p.width_px) * static_cast<std::size_t>(p.height_px));
  for (int row = 0; row < p.height_px; ++row) {
    const auto* line = p.image.ptrLine<std::uint8_t>(static_cast<unsigned>(row));
    bytes->insert(bytes->end(), line, line + static_cast<std::ptrdiff_t>(3 * p.width_px));
  }
  ImageMeasurement out;
  out.width_px = p.width_px;
  out.height_px = p.height_px;
  out.row_stride_bytes = 3 * p.width_px;
  out.format = PixelFormat::kBgr;
  out.data = std::move(bytes);
  return out;
}

}  // namespace loc
