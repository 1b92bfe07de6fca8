// Reads the plain tables of numbers that some recordings come as: comma-separated, perhaps with one heading line.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace loc::test {

inline Eigen::MatrixXd read_number_table(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  std::string line;
  for (bool first = true; std::getline(file, line); first = false) {
    std::vector<double> row;
    std::istringstream cells(line);
    std::string cell;
    while (std::getline(cells, cell, ',')) {
      try {
        row.push_back(std::stod(cell));
      } catch (const std::invalid_argument&) {
        if (!first) throw;
      }
    }
    if (!row.empty()) rows.push_back(std::move(row));
  }
  Eigen::MatrixXd out(rows.size(), rows.empty() ? 0 : rows.front().size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < rows[i].size(); ++j) out(static_cast<int>(i), static_cast<int>(j)) = rows[i].at(j);
  }
  return out;
}

}  // namespace loc::test
