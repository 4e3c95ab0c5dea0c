//! Numbers, strokes, layers and colours as texts of a file, and back.

use super::*;

fn literal(text: &str) -> Literal {
    Literal::read(&crate::document::syntax::parse_value(text).expect(text), text)
}

#[test]
fn numbers_are_read_exactly() {
    assert_eq!(literal("1_000"), Literal::Number(1000.0, Some(1000)));
    assert_eq!(literal("-0x1F"), Literal::Number(-31.0, Some(-31)));
    assert_eq!(literal("2.5e3"), Literal::Number(2500.0, Some(2500)));
    assert_eq!(literal("9223372036854775807"), Literal::Number(9.223_372_036_854_776e18, Some(i64::MAX)));
    assert_eq!(literal("0x-1"), Literal::NotANumber("0x-1".into()));
    assert_eq!(literal("2km"), Literal::NotANumber("2km".into()));
    assert!(matches!(literal("-inf"), Literal::Number(v, None) if v == f64::NEG_INFINITY));
    for value in [0.1, 2e6, 1e-9, 16384.0, 1.0 / 3.0, -0.0, 123_456_789.25, 1e300, 6000.0] {
        assert_eq!(number_text(value).parse(), Ok(value), "{}", number_text(value));
    }
    assert_eq!(
        (number_text(2e6), number_text(6000.0), number_text(2e-6)),
        ("2e6".into(), "6000".into(), "2e-6".into())
    );
}

#[test]
fn strokes_are_read_with_what_is_usual_left_out() {
    let kind = Kind::Strokes { hard: [-1e6, 1e6], timed: false };
    let spec = ParamSpec { name: "strokes", doc: "Strokes.", unit: Unit::Metres, kind, when: &[] };
    let text = "[(tool: raise, radius: 200, strength: 30, points: [(0, 0), (50, 20.5)]), \
                (tool: erase, radius: 80, hardness: 0.9, points: [(1, 2)])]";
    let value = param(&spec, &literal(text)).expect("two strokes");
    assert_eq!(value_text(&value), text);
    let typed = "[(points: [(0, 0), (50, 20.5)], strength: \"30 m\", hardness: 0.5, radius: \"0.2 km\", tool: raise), \
                 (tool: erase, radius: 80, hardness: 0.9, points: [(1, 2)], strength: 1)]";
    assert_eq!(param(&spec, &literal(typed)), Ok(value));
    assert_eq!(param(&spec, &literal("[]")), Ok(ParamValue::Strokes(Vec::new())));
    for (text, said) in [
        ("[(tool: rise, radius: 1, points: [(0, 0)])]", "the tool `rise`"),
        ("[(tool: raise, radius: 1)]", "takes a list of strokes"),
        ("[(tool: raise, radius: 1, points: [])]", "stroke 1 of `strokes`: it has no points"),
        ("[(tool: mask, radius: 1, strength: 2, points: [(0, 0)])]", "`strength` is 2"),
        ("[(tool: raise, radius: 0, points: [(0, 0)])]", "`radius` is 0"),
        ("[(tool: raise, radius: 1, points: [(2e6, 0)])]", "`points` is 2000000"),
        ("[(tool: raise, radius: 1, size: 2, points: [(0, 0)])]", "no field `size`"),
        ("[(tool: raise, radius: 1, points: [(0, NaN)])]", "NaN"),
        ("[(tool: raise, radius: 1, points: [0])]", "takes a list of strokes"),
        ("(0, 0)", "takes a list of strokes"),
        ("[(tool: rain, radius: 1, points: [(0, 0)])]", "the tool `rain`"),
        ("[(tool: raise, radius: 1, time: 5, points: [(0, 0)])]", "`time` is 5"),
    ] {
        let misfit = param(&spec, &literal(text)).expect_err(text);
        assert!(misfit.message.contains(said), "{text}: {}", misfit.message);
    }
    let timed = ParamSpec { kind: Kind::Strokes { hard: [-1e6, 1e6], timed: true }, ..spec };
    let text = "[(tool: rain, radius: 1, strength: 50, time: 600, points: [(0, 0)])]";
    let value = param(&timed, &literal(text)).expect("a stroke");
    assert_eq!(value_text(&value), text);
    assert_eq!(param(&timed, &literal(&text.replace("600", "\"10 min\""))), Ok(value));
    for (text, said) in [
        ("[(tool: smooth, radius: 1, points: [(0, 0)])]", "the tool `smooth`"),
        ("[(tool: rain, radius: 1, time: -1, points: [(0, 0)])]", "`time` is -1"),
    ] {
        let misfit = param(&timed, &literal(text)).expect_err(text);
        assert!(misfit.message.contains(said), "{text}: {}", misfit.message);
    }
}

#[test]
fn layers_are_read_with_what_is_usual_left_out() {
    let kind = Kind::Layers { default: Vec::new() };
    let spec = ParamSpec { name: "layers", doc: "Layers.", unit: Unit::One, kind, when: &[] };
    let text = "[(thickness: 120, hardness: 4, repose: 60, colour: \"#b08050\"), (thickness: 80)]";
    let value = param(&spec, &literal(text)).expect("two layers");
    assert_eq!(value_text(&value), text);
    let typed = "[(colour: \"#b08050\", hardness: 4.0, thickness: \"0.12 km\", repose: \"60°\"), (thickness: 80)]";
    assert_eq!(param(&spec, &literal(typed)), Ok(value));
    assert_eq!(param(&spec, &literal("[]")), Ok(ParamValue::Layers(Vec::new())));
    for (text, said) in [
        ("[(hardness: 4)]", "takes a list of layers"),
        ("[120]", "takes a list of layers"),
        ("[(thickness: 0)]", "layer 1 of `layers`: `thickness` is 0"),
        ("[(thickness: 5), (thickness: -5)]", "layer 2 of `layers`: `thickness` is -5"),
        ("[(thickness: 5, hardness: 0)]", "`hardness` is 0"),
        ("[(thickness: 5, repose: 91)]", "`repose` is 91"),
        ("[(thickness: 5, color: \"#ffffff\")]", "no field `color`"),
        ("[(thickness: 5, colour: \"red\")]", "six hexadecimal digits"),
        ("[(thickness: 5, colour: 3)]", "takes a colour"),
        ("[(thickness: NaN)]", "NaN"),
    ] {
        let misfit = param(&spec, &literal(text)).expect_err(text);
        assert!(misfit.message.contains(said), "{text}: {}", misfit.message);
    }
}

#[test]
fn colours_are_read_with_the_values_that_have_them() {
    let spec = ParamSpec {
        name: "stops",
        doc: "Colours.",
        unit: Unit::Metres,
        kind: Kind::Stops { default: vec![Stop { at: 0.0, colour: crate::Srgb::hex(0) }] },
        when: &[],
    };
    let text = r##"[(-10, "#102030"), (2000, "#ffffff")]"##;
    let value = param(&spec, &literal(text)).expect("two colours");
    assert_eq!(value_text(&value), text);
    assert_eq!(param(&spec, &literal(r##"[(-10, "#102030"), ("2 km", "#ffffff")]"##)), Ok(value));
    for (text, said) in [
        (r##"[(0, "red")]"##, "six hexadecimal digits"),
        (r##"[("#102030", 0)]"##, "a list of values and their colours"),
        (r##"[(0, "#102030", 1)]"##, "a list of values and their colours"),
        ("[]", "at least one"),
        (r##"[(5, "#102030"), (5, "#102030")]"##, "must rise"),
    ] {
        let misfit = param(&spec, &literal(text)).expect_err(text);
        assert!(misfit.message.contains(said), "{text}: {}", misfit.message);
    }
}
