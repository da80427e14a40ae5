//! Parts of the network are linear: their derivatives are their transposes, <A x, y> = <x, A' y>.

use super::*;

fn random(dims: &[usize], rng: &mut Xoshiro256PlusPlus) -> Tensor {
    let n = dims.iter().product::<usize>();
    let values: Vec<f64> = (0..n).map(|_| rng.sample(StandardNormal)).collect();
    Tensor::from_vec(values, dims, &Device::Cpu).unwrap()
}

fn product(a: &Tensor, b: &Tensor) -> f64 {
    (a * b).unwrap().sum_all().unwrap().to_scalar::<f64>().unwrap()
}

/// <A x, y> and <x, A' y>, A' by differentiation.
fn both(linear: impl Fn(&Tensor) -> Result<Tensor>, dims: &[usize]) -> [f64; 2] {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let x = Var::from_tensor(&random(dims, &mut rng)).unwrap();
    // Used twice, as half of the network's layers are.
    let twice = linear(x.as_tensor()).unwrap();
    let y = random(twice.dims(), &mut rng);
    let gradients =
        ((&twice * &y).unwrap() + (&twice * &y).unwrap()).unwrap().sum_all().unwrap().backward().unwrap();
    [2.0 * product(&twice, &y), product(x.as_tensor(), gradients.get(&x).unwrap())]
}

#[test]
fn halving_and_doubling_are_differentiated_by_their_transposes() {
    for (name, [forward, back]) in [
        ("halved", both(halved, &[2, 6, 10, 3])),
        ("doubled", both(doubled, &[2, 3, 5, 4])),
        ("doubled after halving", both(|x| doubled(&halved(x)?), &[1, 8, 4, 2])),
    ] {
        assert!((forward / back - 1.0).abs() < 1e-12, "{name}: {forward} {back}");
    }
}

/// The ones of the bias make it affine: A x + b, whose b is A 0.
#[test]
fn gathering_neighbours_is_differentiated_by_its_transpose() {
    let dims = [2, 5, 7, 3];
    let zero = Tensor::zeros(&dims, candle_core::DType::F64, &Device::Cpu).unwrap();
    let bias = zero.apply_op1(Neighbours).unwrap();
    let [forward, back] = both(|x| x.apply_op1(Neighbours)? - &bias, &dims);
    assert!((forward / back - 1.0).abs() < 1e-12, "{forward} {back}");
}

#[test]
fn a_pixel_is_gathered_with_those_around_it() {
    let numbers: Vec<f64> = (1..=6).map(f64::from).collect();
    let input = Tensor::from_vec(numbers, (1, 2, 3, 1), &Device::Cpu).unwrap();
    let rows = input.apply_op1(Neighbours).unwrap().to_vec2::<f64>().unwrap();
    // Of   4 5 6   in the second row, and of 1 2 3 in the first.
    assert_eq!(rows[0], [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 4.0, 5.0, 1.0]);
    assert_eq!(rows[4], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 1.0]);
}

/// Linear in weights and in input, so that differences are exact but for rounding.
#[test]
fn a_convolution_s_gradients_are_those_of_differences() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
    let input = Var::from_tensor(&random(&[2, 4, 5, 3], &mut rng)).unwrap();
    let weights = Var::from_tensor(&random(&[28, 2], &mut rng)).unwrap();
    let y = random(&[2, 4, 5, 2], &mut rng);
    let value =
        || (convolved(input.as_tensor(), weights.as_tensor()).unwrap() * &y).unwrap().sum_all().unwrap();
    let gradients = value().backward().unwrap();
    for variable in [&input, &weights] {
        let direction = random(variable.dims(), &mut rng);
        let found = product(gradients.get(variable).unwrap(), &direction);
        let before = variable.as_tensor().copy().unwrap();
        let start = value().to_scalar::<f64>().unwrap();
        variable.set(&(&before + &direction).unwrap()).unwrap();
        let difference = value().to_scalar::<f64>().unwrap() - start;
        variable.set(&before).unwrap();
        assert!((found / difference - 1.0).abs() < 1e-10, "{found} {difference}");
    }
}

/// Wherever a part begins, and however far its middle is from the edges.
#[test]
fn parts_are_seen_as_the_whole_is() {
    let (n_rows, n_cols) = (70, 86);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let values = (0..CHANNELS * n_rows * n_cols).map(|_| rng.random_range(0.0..1.0)).collect();
    let view = View { resolution_m: 0.5, south_west_m: [0.0; 2], n_rows, n_cols, values };
    let network = Network::new(0.5, 2).unwrap();
    let whole = network.see(&view).unwrap();
    for ([row, col], [height, width]) in [([0, 0], [5, 7]), ([33, 42], [4, 9]), ([63, 79], [7, 7])] {
        let part = network.see_part(&view, [row, col], [height, width]).unwrap();
        for (index, found) in part.iter().enumerate() {
            let expected = whole[(row + index / width) * n_cols + col + index % width];
            for (found, expected) in found.iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 1e-4, "{row} {col} {index}: {found} {expected}");
            }
        }
    }
}
