// The windows' normal equations against one dense matrix.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <vector>

#include "libloc/calib/chain_system.hpp"
#include "libloc/core/random.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::near;

struct Dense {
  MatrixXd matrix;
  VectorXd gradient;
  std::vector<VectorXd> gradients;  // of each window
};

// Places of a window's unknowns in the dense system: all inner, then all nodes, then the shared ones.
std::vector<Index> places(const ChainLayout& layout, int window) {
  std::vector<Index> out;
  Index inner = 0;
  Index all_inner = 0;
  for (int w = 0; w < layout.windows(); ++w) {
    if (w < window) inner += layout.inner[static_cast<std::size_t>(w)];
    all_inner += layout.inner[static_cast<std::size_t>(w)];
  }
  for (int i = 0; i < layout.inner[static_cast<std::size_t>(window)]; ++i) out.push_back(inner + i);
  for (int i = 0; i < 2 * layout.node; ++i) out.push_back(all_inner + static_cast<Index>(window) * layout.node + i);
  const Index shared = all_inner + static_cast<Index>(layout.windows() + 1) * layout.node;
  for (int i = 0; i < layout.shared; ++i) out.push_back(shared + i);
  return out;
}

Dense fill(ChainSystem& system) {
  const ChainLayout& layout = system.layout();
  const Index n = places(layout, layout.windows() - 1).back() + 1;
  Dense out{MatrixXd::Zero(n, n), VectorXd::Zero(n), {}};
  Random random(5);
  system.clear();
  for (int w = 0; w < layout.windows(); ++w) {
    const Index size = layout.local_size(w);
    const MatrixXd J = MatrixXd::NullaryExpr(size + 3, size, [&] { return random.normal(); });
    const MatrixXd H = J.transpose() * J;
    const VectorXd g = VectorXd::NullaryExpr(size, [&] { return random.normal(); });
    system.matrix(w).triangularView<Eigen::Lower>() += H;
    system.gradient(w) += g;
    out.gradients.emplace_back(VectorXd::Zero(n));
    const std::vector<Index> at = places(layout, w);
    for (std::size_t i = 0; i < at.size(); ++i) {
      out.gradients.back()[at[i]] += g[static_cast<Index>(i)];
      for (std::size_t j = 0; j < at.size(); ++j) {
        out.matrix(at[i], at[j]) += H(static_cast<Index>(i), static_cast<Index>(j));
      }
    }
    out.gradient += out.gradients.back();
  }
  return out;
}

VectorXd flat(const ChainStep& step) {
  Index n = step.shared.size();
  for (const VectorXd& v : step.inner) n += v.size();
  for (const VectorXd& v : step.node) n += v.size();
  VectorXd out(n);
  Index at = 0;
  const auto put = [&](const VectorXd& v) {
    out.segment(at, v.size()) = v;
    at += v.size();
  };
  for (const VectorXd& v : step.inner) put(v);
  for (const VectorXd& v : step.node) put(v);
  put(step.shared);
  return out;
}

TEST(ChainSystem, IsTheDenseSystem) {
  for (const ChainLayout& layout :
       {ChainLayout{{7, 4, 0, 5}, 3, 4}, ChainLayout{{3}, 2, 1}, ChainLayout{{4, 4}, 2, 0}}) {
    ChainSystem system(layout);
    const Dense dense = fill(system);
    for (const double damping : {0.0, 0.3}) {
      MatrixXd H = dense.matrix;
      H.diagonal() *= 1 + damping;
      ChainStep step;
      ASSERT_TRUE(system.solve(damping, step));
      const VectorXd x = H.ldlt().solve(-dense.gradient);
      EXPECT_TRUE(near(flat(step), x, 1e-9));
      EXPECT_NEAR(system.slope(step), dense.gradient.dot(x), 1e-8);
      EXPECT_NEAR(system.damped_square(step), x.dot(dense.matrix.diagonal().cwiseProduct(x)), 1e-8);
      if (layout.shared == 0) continue;
      const MatrixXd inverse = H.inverse();
      EXPECT_TRUE(near(system.shared_covariance(), inverse.bottomRightCorner(layout.shared, layout.shared), 1e-10));
      std::vector<int> group(static_cast<std::size_t>(layout.windows()), 0);
      group.back() = 1;
      const MatrixXd pulls = system.shared_pulls(group, 2);
      const Index rest = H.rows() - layout.shared;
      for (int g = 0; g < 2; ++g) {
        VectorXd gradient = VectorXd::Zero(H.rows());
        for (std::size_t w = 0; w < group.size(); ++w) {
          if (group[w] == g) gradient += dense.gradients[w];
        }
        const VectorXd expected =
            gradient.tail(layout.shared) -
            H.bottomLeftCorner(layout.shared, rest) * H.topLeftCorner(rest, rest).ldlt().solve(gradient.head(rest));
        EXPECT_TRUE(near(pulls.col(g), expected, 1e-9)) << g;
      }
    }
  }
}

TEST(ChainSystem, AnUndeterminedOneIsRefused) {
  const ChainLayout layout{{3, 3}, 2, 2};
  for (int where = 0; where < 3; ++where) {
    ChainSystem system(layout);
    fill(system);
    for (int w = 0; w < 2; ++w) {
      // One unknown that nothing depends on.
      const Index i = where == 0 ? 0 : where == 1 ? (w == 0 ? 6 : 4) : 8;
      if (where == 0 && w == 1) continue;
      system.matrix(w).row(i).setZero();
      system.matrix(w).col(i).setZero();
      system.gradient(w)[i] = 0;
    }
    ChainStep step;
    EXPECT_FALSE(system.solve(0, step)) << where;
    EXPECT_THROW(system.shared_covariance(), std::invalid_argument) << where;
    // A shared unknown is left over by the elimination: what pulls at it can still be told.
    EXPECT_EQ(system.reduce(), where == 2) << where;
    if (where == 2) {
      EXPECT_EQ(system.shared_information()(1, 1), 0);
      EXPECT_EQ(system.shared_pulls({0, 0}, 1)(1, 0), 0);
    } else {
      EXPECT_THROW(system.shared_pulls({0, 0}, 1), std::invalid_argument) << where;
    }
  }
  ChainSystem fresh(layout);
  fill(fresh);
  EXPECT_THROW(fresh.shared_covariance(), std::invalid_argument);
  EXPECT_THROW(fresh.shared_pulls({0, 0}, 1), std::invalid_argument);
  ChainStep step;
  ASSERT_TRUE(fresh.solve(0, step));
  const MatrixXd covariance = fresh.shared_covariance();
  ASSERT_TRUE(fresh.reduce());
  EXPECT_TRUE(near(fresh.shared_information() * covariance, MatrixXd::Identity(2, 2), 1e-12));
  EXPECT_THROW(fresh.shared_covariance(), std::invalid_argument);
  EXPECT_THROW(fresh.shared_pulls({0, 1}, 1), std::invalid_argument);
  EXPECT_THROW(ChainSystem({{}, 2, 2}), std::invalid_argument);
  EXPECT_THROW(ChainSystem({{2}, -1, 2}), std::invalid_argument);
}

}  // namespace
}  // namespace loc::calib
