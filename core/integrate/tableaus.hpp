// Explicit Runge-Kutta methods as tables. Step, tangent-linear and adjoint are written once (explicit_*.hpp) and read
// these.
//
//   Y_i = y0 + h sum_j A_ij k_j,   k_i = f(t0 + c_i h, Y_i),   y1 = y0 + h sum_i b_i k_i
//   dense output:  y(t0 + theta h) = y0 + h sum_i b_i(theta) k_i,   b_i(theta) = sum_j dense_ij theta^(j+1)
//
// Stages beyond the first S serve dense output only and are computed only where it is asked for. The error of a step is
// the norm of h sum_i error_i k_i; where error_low is there, too, the two are combined as in DOP853.
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace mbsopt {

template <int S, int T = S>  // stages of the step, and with those of dense output
struct Tableau {
  std::string_view name;
  int order = 0, dense_order = 0;
  std::array<double, T> c{};
  std::array<std::array<double, T>, T> A{};
  std::array<double, S> b{};
  std::array<double, S> error{};      // b - b^, all zero: no estimate, fixed steps only
  std::array<double, S> error_low{};  // a second, lower estimate
  std::array<std::array<double, 7>, T> dense{};
};

constexpr double magnitude(double x) { return x < 0 ? -x : x; }

template <int S, int T>
constexpr bool rows_sum_to_c(const Tableau<S, T>& rk) {
  for (std::size_t i = 0; i < T; ++i) {
    double sum = -rk.c[i];
    for (std::size_t j = 0; j < T; ++j) sum += rk.A[i][j];
    if (magnitude(sum) > 2e-15) return false;
  }
  return true;
}
template <int S, int T>
constexpr bool is_explicit(const Tableau<S, T>& rk) {
  for (std::size_t i = 0; i < T; ++i) {
    for (std::size_t j = i; j < T; ++j) {
      if (rk.A[i][j] != 0) return false;
    }
  }
  return true;
}
// Dense output ends at y1: b_i(1) = b_i.
template <int S, int T>
constexpr bool dense_ends_at_step(const Tableau<S, T>& rk) {
  for (std::size_t i = 0; i < T; ++i) {
    double sum = i < S ? -rk.b[i] : 0.0;
    for (const double d : rk.dense[i]) sum += d;
    if (magnitude(sum) > 1e-11) return false;
  }
  return true;
}

// Kutta's classical method: Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I", section II.1; its
// continuous extension of order 3: section II.6, exercise 1.
inline constexpr Tableau<4> kRk4{"rk4",
                                 4,
                                 3,
                                 {0, 0.5, 0.5, 1},
                                 {{{0}, {0.5}, {0, 0.5}, {0, 0, 1}}},
                                 {1. / 6, 1. / 3, 1. / 3, 1. / 6},
                                 {},
                                 {},
                                 {{{1, -1.5, 2. / 3}, {0, 1, -2. / 3}, {0, 1, -2. / 3}, {0, -0.5, 2. / 3}}}};
static_assert(rows_sum_to_c(kRk4) && is_explicit(kRk4) && dense_ends_at_step(kRk4));

// Dormand and Prince, "A family of embedded Runge-Kutta formulae", J. Comp. Appl. Math. 6 (1980); dense output of order
// 4 by Shampine, "Some practical Runge-Kutta formulas", Math. Comp. 46 (1986), as in Hairer, Norsett, Wanner, section
// II.6.
inline constexpr Tableau<7> kDopri5{
    "dopri5",
    5,
    4,
    {0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1, 1},
    {{{0},
      {1. / 5},
      {3. / 40, 9. / 40},
      {44. / 45, -56. / 15, 32. / 9},
      {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
      {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
      {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}}},
    {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84, 0},
    {71. / 57600, 0, -71. / 16695, 71. / 1920, -17253. / 339200, 22. / 525, -1. / 40},
    {},
    {{{1, -8048581381. / 2820520608, 8663915743. / 2820520608, -12715105075. / 11282082432},
      {0, 0, 0, 0},
      {0, 131558114200. / 32700410799, -68118460800. / 10900136933, 87487479700. / 32700410799},
      {0, -1754552775. / 470086768, 14199869525. / 1410260304, -10690763975. / 1880347072},
      {0, 127303824393. / 49829197408, -318862633887. / 49829197408, 701980252875. / 199316789632},
      {0, -282668133. / 205662961, 2019193451. / 616988883, -1453857185. / 822651844},
      {0, 40617522. / 29380423, -110615467. / 29380423, 69997945. / 29380423}}}};
static_assert(rows_sum_to_c(kDopri5) && is_explicit(kDopri5) && dense_ends_at_step(kDopri5));

namespace dop853 {

// The dense output of DOP853 in its original form,
//   y = y0 + theta (F0 + (1 - theta)(F1 + theta (F2 + (1 - theta)(F3 + theta (F4 + (1 - theta)(F5 + theta F6))))))
//   F0 = y1 - y0,  F1 = h k1 - F0,  F2 = 2 F0 - h (k13 + k1),  F(3+j) = h sum_i D_ji k_i
// multiplied out to powers of theta.
inline constexpr std::array<std::array<double, 16>, 4> kD{
    {{-8.428938276109013, 0, 0, 0, 0, 0.5667149535193777, -3.0689499459498917, 2.38466765651207, 2.117034582445028,
      -0.871391583777973, 2.2404374302607883, 0.6315787787694688, -0.08899033645133331, 18.148505520854727,
      -9.194632392478356, -4.436036387594894},
     {10.427508642579134, 0, 0, 0, 0, 242.28349177525817, 165.20045171727028, -374.5467547226902, -22.113666853125306,
      7.733432668472264, -30.674084731089398, -9.332130526430229, 15.697238121770845, -31.139403219565178,
      -9.35292435884448, 35.81684148639408},
     {19.985053242002433, 0, 0, 0, 0, -387.0373087493518, -189.17813819516758, 527.8081592054236, -11.57390253995963,
      6.8812326946963, -1.0006050966910838, 0.7777137798053443, -2.778205752353508, -60.19669523126412,
      84.32040550667716, 11.99229113618279},
     {-25.69393346270375, 0, 0, 0, 0, -154.18974869023643, -231.5293791760455, 357.6391179106141, 93.40532418362432,
      -37.45832313645163, 104.0996495089623, 29.8402934266605, -43.53345659001114, 96.32455395918828,
      -39.17726167561544, -149.72683625798564}}};

constexpr std::array<std::array<double, 7>, 16> dense(const std::array<double, 12>& b) {
  // basis[k] = theta^(k/2 + 1) (1 - theta)^((k + 1)/2) in powers theta^1 .. theta^7
  std::array<std::array<double, 7>, 7> basis{};
  basis[0][0] = 1;
  for (std::size_t k = 1; k < 7; ++k) {
    for (std::size_t j = 0; j < 7; ++j) {
      if (k % 2 == 1) {
        basis[k][j] += basis[k - 1][j];
        if (j > 0) basis[k][j] -= basis[k - 1][j - 1];
      } else if (j > 0) {
        basis[k][j] += basis[k - 1][j - 1];
      }
    }
  }
  std::array<std::array<double, 7>, 16> out{};
  for (std::size_t i = 0; i < 16; ++i) {
    for (std::size_t j = 0; j < 7; ++j) {
      const double b_i = i < 12 ? b[i] : 0.0;
      double x = b_i * (basis[0][j] - basis[1][j] + 2 * basis[2][j]);
      if (i == 0) x += basis[1][j] - basis[2][j];
      if (i == 12) x -= basis[2][j];
      for (std::size_t k = 0; k < 4; ++k) x += kD[k][i] * basis[3 + k][j];
      out[i][j] = x;
    }
  }
  return out;
}

}  // namespace dop853

// Dormand and Prince's method of order 8 with Hairer's two error estimates and dense output of order 7: Hairer,
// Norsett, Wanner, "Solving Ordinary Differential Equations I" (1993), section II.10 and appendix.
inline constexpr Tableau<12, 16> kDopri853{
    "dopri853",
    8,
    7,
    {0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 0.3333333333333333, 0.25,
     0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0, 1.0, 0.1, 0.2, 0.7777777777777778},
    {{
        {0},
        {0.05260015195876773},
        {0.0197250569845379, 0.0591751709536137},
        {0.02958758547680685, 0, 0.08876275643042054},
        {0.2413651341592667, 0, -0.8845494793282861, 0.924834003261792},
        {0.037037037037037035, 0, 0, 0.17082860872947386, 0.12546768756682242},
        {0.037109375, 0, 0, 0.17025221101954405, 0.06021653898045596, -0.017578125},
        {0.03709200011850479, 0, 0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402,
         0.008273789163814023},
        {0.6241109587160757, 0, 0, -3.3608926294469414, -0.868219346841726, 27.59209969944671, 20.154067550477894,
         -43.48988418106996},
        {0.47766253643826434, 0, 0, -2.4881146199716677, -0.590290826836843, 21.230051448181193, 15.279233632882423,
         -33.28821096898486, -0.020331201708508627},
        {-0.9371424300859873, 0, 0, 5.186372428844064, 1.0914373489967295, -8.149787010746927, -18.52006565999696,
         22.739487099350505, 2.4936055526796523, -3.0467644718982196},
        {2.273310147516538, 0, 0, -10.53449546673725, -2.0008720582248625, -17.9589318631188, 27.94888452941996,
         -2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636},
        {0.054293734116568765, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
         0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259},
        {0.056167502283047954, 0, 0, 0, 0, 0, 0.25350021021662483, -0.2462390374708025, -0.12419142326381637,
         0.15329179827876568, 0.00820105229563469, 0.007567897660545699, -0.008298},
        {0.03183464816350214, 0, 0, 0, 0, 0.028300909672366776, 0.053541988307438566, -0.05492374857139099, 0, 0,
         -0.00010834732869724932, 0.0003825710908356584, -0.00034046500868740456, 0.1413124436746325},
        {-0.42889630158379194, 0, 0, 0, 0, -4.697621415361164, 7.683421196062599, 4.06898981839711, 0.3567271874552811,
         0, 0, 0, -0.0013990241651590145, 2.9475147891527724, -9.15095847217987},
    }},
    {0.054293734116568765, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585, 0.3111643669578199,
     -0.1521609496625161, 0.20136540080403034, 0.04471061572777259},
    {0.01312004499419488, 0, 0, 0, 0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
     -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294},
    {-0.18980075407240762, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585, -0.4226823213237919,
     -0.1521609496625161, 0.20136540080403034, 0.02265179219836082},
    dop853::dense({0.054293734116568765, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
                   0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259})};
static_assert(rows_sum_to_c(kDopri853) && is_explicit(kDopri853) && dense_ends_at_step(kDopri853));

// A tableau with its sizes as data, so that a step is written once and compiled once.
struct Method {
  std::string_view name;
  int order = 0, dense_order = 0;
  int stages = 0, dense_stages = 0;  // of the step; with those of dense output
  const double* c = nullptr;
  const double* A = nullptr;  // dense_stages x dense_stages, row by row
  const double* b = nullptr;
  const double* error = nullptr;
  const double* error_low = nullptr;  // null: none
  const double* dense = nullptr;      // dense_stages x 7
  bool adaptive = false;

  double a(int i, int j) const { return A[i * dense_stages + j]; }
  double dense_weight(int i, double theta) const {
    double x = 0;
    for (int j = 6; j >= 0; --j) x = (x + dense[7 * i + j]) * theta;
    return x;
  }
};

// The explicit methods by name; null when there is none of that name.
const Method* explicit_method(std::string_view name);
std::span<const Method> explicit_methods();

}  // namespace mbsopt
