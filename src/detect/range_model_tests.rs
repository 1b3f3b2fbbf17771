//! What a range model learns, and forgets.

use super::*;

#[test]
fn an_azimuth_lies_in_its_bin_whatever_it_is() {
    let model = RangeModel::new(0.2);
    for (azimuth_cdeg, bin) in [
        (0.0, 0),
        (19.9, 0),
        (20.0, 1),
        (35_999.0, 1799),
        (36_000.0, 0),
        (-0.5, 1799),
        (-35_999.0, 0),
        (71_999.0, 1799),
        (f32::NAN, 1799),
        (f32::INFINITY, 1799),
        (1e30, 1799),
        (-1e30, 0),
    ] {
        assert_eq!(model.bin(azimuth_cdeg), bin, "{azimuth_cdeg}");
    }
}

#[test]
fn a_column_is_new_where_one_of_its_pixels_is_however_its_beams_lie() {
    let mut model = RangeModel::new(1.0);
    model.grow(ROWS);
    (0..model.limit_m.len()).for_each(|pixel| model.limit_m[pixel] = 2.0 + (pixel * 7 % 13) as f32);
    let columns = [
        [500.0; ROWS],
        [510.0, 520.0, 580.0, 590.0],
        [590.0, 595.0, 600.0, 605.0],
        [35_990.0, 36_010.0, 35_900.0, 0.0],
        [35_990.0, 35_995.0, 36_005.0, 36_010.0],
        [-10.0, -5.0, 5.0, 10.0],
        [550.0, 600.0, 650.0, 700.0],
        [0.0, 500.0, 9e3, 2e4],
    ];
    for azimuths_cdeg in columns {
        let mut pixels = [0; ROWS];
        model.pixels(&azimuths_cdeg, &mut pixels);
        let limits_m = pixels.map(|pixel| model.limit_m(pixel as usize));
        // What is told of all beams at once, of those columns of which it is.
        let bins_of_pixels = pixels.map(|pixel| pixel as usize / ROWS);
        let [first, last] = [bins_of_pixels[0], bins_of_pixels[ROWS - 1]];
        let bins = model.one_or_two_bins([azimuths_cdeg[0], azimuths_cdeg[ROWS - 1]]);
        assert_eq!(bins.is_some(), (last + model.bins - first) % model.bins <= 1, "{azimuths_cdeg:?}");
        assert!(bins.is_none() || bins_of_pixels.iter().all(|bin| *bin == first || *bin == last));
        let any_new = |ranges_m: &[f32; ROWS]| {
            let new = model.any_new(&pixels, ranges_m);
            let may_be = bins.is_none_or(|bins| model.may_be_new(bins, ranges_m));
            assert!(may_be || !new, "{azimuths_cdeg:?}");
            assert!(may_be == new || first != last, "{azimuths_cdeg:?}: one bin leaves no doubt");
            new
        };
        assert!(!any_new(&limits_m), "{azimuths_cdeg:?}");
        let far_m = [100.0; ROWS];
        assert!(bins.is_none_or(|bins| !model.may_be_new(bins, &far_m)), "{azimuths_cdeg:?}: told at once");
        assert!(!any_new(&[0.0; ROWS]), "nothing came back");
        for row in 0..ROWS {
            for nearer_m in [limits_m[row] - 0.001, f32::NAN] {
                let mut ranges_m = limits_m;
                ranges_m[row] = nearer_m;
                assert!(any_new(&ranges_m), "{azimuths_cdeg:?}, row {row}");
            }
        }
    }
}

#[test]
fn who_comes_and_stands_where_somebody_is_expected_never_becomes_the_background() {
    let mut model = RangeModel::new(1.0);
    model.grow(ROWS);
    for _ in 0..40 {
        look(&mut model, 0, 0);
    }
    // Two revolutions until somebody is expected there, then a minute and a half.
    for revolution in 0..900 {
        for bin in 0..model.bins {
            for row in 0..ROWS {
                let pixel = bin * ROWS + row;
                match (10..14).contains(&bin) {
                    true if revolution < 2 => model.observe(pixel, NEAR_M),
                    true => model.freeze(pixel),
                    false => model.observe(pixel, FAR_M),
                }
            }
        }
        model.close_revolution(false);
        assert!(model.limit_m(12 * ROWS) > NEAR_M, "revolution {revolution}");
    }
}

/// The margin once followed from the site file's key that also draws the simulator's noise.
#[test]
fn the_margin_comes_from_how_the_empty_hall_scatters() {
    let margin_m = |off_m: f32| {
        let mut model = RangeModel::new(1.0);
        model.grow(ROWS);
        for revolution in 0..20 {
            // Mean absolute deviation: `off_m`.
            let range_m = FAR_M + if revolution % 2 == 0 { off_m } else { -off_m };
            (0..model.bins * ROWS).for_each(|pixel| model.observe(pixel, range_m));
            model.close_revolution(true);
        }
        model.margin_m
    };
    assert_eq!(margin_m(0.001), 0.05, "never less: bodies breathe, walls shake");
    assert!((margin_m(0.016) - 0.1).abs() < 0.01, "{}", margin_m(0.016));
    assert!((margin_m(0.03) - 0.19).abs() < 0.02, "{}", margin_m(0.03));
}

const ROWS: usize = 4;
const NEAR_M: f32 = 5.0;
const FAR_M: f32 = 10.0;

/// One revolution in bins of one degree: something at 5 m in bins `first..end`, a wall at 10 m around it.
fn look(model: &mut RangeModel, first: usize, end: usize) {
    for bin in 0..model.bins {
        let range_m = if (first..end).contains(&bin) { NEAR_M } else { FAR_M };
        for row in 0..model.rows {
            model.observe(bin * model.rows + row, range_m);
        }
    }
    model.close_revolution(false);
}

fn learned(first: usize, end: usize) -> RangeModel {
    let mut model = RangeModel::new(1.0);
    model.grow(ROWS);
    for _ in 0..10 {
        look(&mut model, first, end);
    }
    model
}

fn is_new(model: &RangeModel, bin: usize) -> bool {
    (0..ROWS).all(|row| NEAR_M < model.limit_m(bin * ROWS + row))
}

#[test]
fn who_walks_off_is_forgotten_as_a_whole() {
    let mut model = learned(100, 106);
    assert!(!is_new(&model, 104));
    for step in 1..=3 {
        look(&mut model, 100 + step, 106 + step);
    }
    assert!(is_new(&model, 104));
}

#[test]
fn what_stays_is_not_forgotten_where_its_edge_goes() {
    // A pillar whose edge is no longer hit, and a wall that a walker leaves.
    for (first, end) in [(100, 106), (100, 180)] {
        let mut model = learned(first, end);
        for _ in 0..5 {
            look(&mut model, first + 2, end);
        }
        assert!(!is_new(&model, first + 4), "{first}..{end}");
    }
    let mut wall = learned(100, 180);
    for step in 1..=5 {
        look(&mut wall, 100 + step, 180 + step);
    }
    assert!(!is_new(&wall, 140));
}

/// A live run that began within a revolution, or lost packets of the first one, took walls for people and never learned them.
#[test]
fn a_wall_that_the_first_revolution_did_not_look_at_is_no_person() {
    let mut model = RangeModel::of_rays(1.0);
    model.grow(ROWS);
    let pixels = |bins: std::ops::Range<usize>| bins.start * ROWS..bins.end * ROWS;
    // Walls all round but for ten bins, from which nothing comes back.
    let open = pixels(300..310);
    let mut turn = |bins: std::ops::Range<usize>| {
        for pixel in pixels(bins) {
            model.look(pixel);
            if !open.contains(&pixel) {
                model.observe(pixel, 5.0);
            }
        }
        model.close_revolution(false);
        [100, 250, 305].map(|bin| model.limit_m(bin * ROWS))
    };
    let [wall_m, not_looked_at_m, _] = turn(0..180);
    assert!((4.5..5.0).contains(&wall_m), "{wall_m}");
    assert!(not_looked_at_m <= 0.0, "nothing is new there yet: {not_looked_at_m}");
    let [wall_m, seen_later_m, open_m] = turn(0..360);
    assert!(
        [wall_m, seen_later_m].iter().all(|limit_m| (4.5..5.0).contains(limit_m)),
        "{wall_m} {seen_later_m}"
    );
    assert!(open_m.is_infinite(), "whatever appears there is new");
}

/// Somebody stood in a hall without an empty scan and was taken for it, from the head down: a bin beside him had seen his edge in the
/// revolution before, kept its range, and so he was taken to go on behind himself.
#[test]
fn who_stands_there_first_is_forgotten_with_the_edges_that_he_showed_before() {
    let mut model = RangeModel::of_rays(1.0);
    model.grow(ROWS);
    let somebody = 100..106;
    for bins in [99..105, 100..106] {
        for pixel in 0..360 * ROWS {
            model.look(pixel);
            model.observe(pixel, if bins.contains(&(pixel / ROWS)) { 8.0 } else { 14.0 });
        }
        model.close_revolution(false);
    }
    let theirs: Vec<usize> = somebody.flat_map(|bin| bin * ROWS..(bin + 1) * ROWS).collect();
    model.forget(&theirs);
    for bin in 99..106 {
        assert!((0..ROWS).all(|row| model.limit_m(bin * ROWS + row) > 13.0), "bin {bin}");
    }
}
