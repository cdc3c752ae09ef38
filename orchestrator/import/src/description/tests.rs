use super::*;
use fmi_master::description::ScalarType;

const TEXT: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Demo" guid="{1}" xmlns:xsi="http://x" extra="ignored">
  <CoSimulation modelIdentifier="Demo" canHandleVariableCommunicationStepSize="true" maxOutputDerivativeOrder="1"/>
  <UnitDefinitions>
<Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.29577951308232"/></Unit>
<Unit name="m"><BaseUnit m="1"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
<SimpleType name="Angle"><Real unit="rad" max="2"/></SimpleType>
<SimpleType name="Kind"><Enumeration><Item name="none" value="1"/><Item name="white" value="2"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <LogCategories><Category name="logAll"/></LogCategories>
  <DefaultExperiment stopTime="50" stepSize="0.04"/>
  <VendorAnnotations><Tool name="x"><y/><Optional><Input name="u"/><Input/><Input name="none"/></Optional></Tool></VendorAnnotations>
  <ModelVariables>
<!-- index 1 -->
<ScalarVariable name="u" valueReference="7" causality="input"><Real declaredType="Angle" start="0.5"/></ScalarVariable>
<ScalarVariable name="y" valueReference="8" causality="output"><Real unit="m"/><Annotations><Tool name="z"/></Annotations></ScalarVariable>
<ScalarVariable name="kind" valueReference="9" causality="parameter" variability="fixed"><Enumeration declaredType="Kind" start="2"/></ScalarVariable>
<ScalarVariable name="z" valueReference="10" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies="1"/><Unknown index="4"/></Outputs></ModelStructure>
</fmiModelDescription>"#;

#[test]
fn everything_needed_is_read() {
    let description = parse(TEXT).unwrap();
    assert!(
        description.co_simulation.as_ref().unwrap().has("canHandleVariableCommunicationStepSize")
    );
    assert_eq!(description.default_experiment.stop, Some(50.0));
    assert_eq!(description.units[0].displays[0].0, "deg");
    let (_, u) = description.find("u").unwrap();
    let real = VariableKind::Real {
        unit: Some("rad".into()),
        display_unit: None,
        is_relative: false,
        min: None,
        max: Some(2.0),
        nominal: None,
    };
    assert_eq!((u.reference, &u.kind, u.start.as_deref()), (7, &real, Some("0.5")));
    let optional = description.variables.iter().filter(|variable| variable.is_optional);
    assert_eq!(optional.map(|variable| &variable.name).collect::<Vec<_>>(), ["u"]);
    let items = vec![("none".to_string(), 1), ("white".to_string(), 2)];
    assert_eq!(description.find("kind").unwrap().1.kind, VariableKind::Enumeration { items });
    // A declaration of no dependencies is distinguished from a missing declaration.
    assert_eq!(description.dependencies, BTreeMap::from([(1, vec![0])]));
}

#[test]
fn what_cannot_be_used_is_refused_by_index_element_and_line() {
    let index = TEXT.replace("index=\"4\"", "index=\"5\"");
    assert!(parse(&index).unwrap_err().contains("refers to the index 5, which no variable has"));
    let reference = TEXT.replace("valueReference=\"9\"", "valueReference=\"-1\"");
    let fault = "valueReference = \"-1\" of the element ScalarVariable \"kind\" in line 19 is not a whole number";
    assert!(parse(&reference).unwrap_err().starts_with(fault));
    let untyped = TEXT.replace("<Real/>", "");
    assert!(parse(&untyped).unwrap_err().contains("\"z\" in line 20 has no type"));
}

const TEXT3: &str = r#"<fmiModelDescription fmiVersion="3.0" modelName="Demo" instantiationToken="{3}">
  <CoSimulation modelIdentifier="Demo" hasEventMode="true" providesDirectionalDerivatives="true"/>
  <TypeDefinitions>
    <Float32Type name="Angle" unit="rad" max="2"/>
    <EnumerationType name="Kind"><Item name="none" value="1"/></EnumerationType>
  </TypeDefinitions>
  <ModelVariables>
    <Float32 name="A" valueReference="7" causality="input" declaredType="Angle" start="1 2 3 4 5 6">
      <Dimension valueReference="4"/><Dimension start="3"/><Alias name="B" description="b"/>
    </Float32>
    <Float64 name="x" valueReference="9" causality="output" start="0.5"><Dimension start="2"/></Float64>
    <UInt64 name="rows" valueReference="4" causality="structuralParameter" start="2"/>
    <Float64 name="der(x)" valueReference="2" derivative="9"><Dimension start="2"/></Float64>
    <UInt8 name="byte" valueReference="5" min="3"/>
    <Int64 name="long" valueReference="6" max="3000000000" start="9000000000"/>
    <Enumeration name="kind" valueReference="8" declaredType="Kind" causality="parameter"/>
    <Clock name="tick" valueReference="1" intervalVariability="countdown"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="9" dependencies="7 5"/></ModelStructure>
</fmiModelDescription>"#;

#[test]
fn arrays_aliases_and_types_of_fmi_3_become_scalar_variables() {
    let description = parse(TEXT3).unwrap();
    assert!(description.co_simulation.unwrap().has("providesDirectionalDerivative"));
    assert_eq!(description.guid, "{3}");
    let variable = |name: &str| description.variables.iter().find(|v| v.name == name).unwrap();
    let place = |name: &str| description.places[variable(name).reference as usize];
    let scalar = ScalarType::Float32;
    let last = Place { scalar, reference: 7, element: 5, length: 6 };
    assert_eq!([place("A[2,3]"), place("B[2,3]")], [last; 2]);
    assert_eq!(
        place("rows"),
        Place { scalar: ScalarType::UInt64, reference: 4, element: 0, length: 1 }
    );
    let start = |name: &str| variable(name).start.as_deref();
    assert_eq!([start("A[1,2]"), start("B[1,2]"), start("x[2]")], [Some("2"), None, Some("0.5")]);
    assert_eq!((&*variable("B[1,1]").causality, &*variable("B[1,1]").description), ("local", "b"));
    assert_eq!(variable("A[1,1]").kind.unit(), Some("rad"));
    assert_eq!(variable("byte").kind, VariableKind::Integer { min: Some(3), max: Some(255) });
    assert_eq!(variable("long").kind, VariableKind::Integer { min: None, max: None });
    assert_eq!(
        [&*variable("byte").variability, &*variable("kind").variability],
        ["discrete", "fixed"]
    );
    assert_eq!(variable("tick").kind, VariableKind::Clock { interval: "countdown".into() });
    let (x, derivative) = (&description.arrays["x"], &description.arrays["der(x)"]);
    assert_eq!((&x.shape[..], x.elements.clone()), (&[2][..], 12..14));
    let of = |position: usize| description.variables[position].derivative_of;
    assert_eq!(derivative.elements.clone().map(of).collect::<Vec<_>>(), [Some(12), Some(13)]);
    let needed = vec![0, 1, 2, 3, 4, 5, 17];
    assert_eq!(description.dependencies, BTreeMap::from([(12, needed.clone()), (13, needed)]));
}

#[test]
fn what_is_wrong_with_a_description_of_fmi_3_is_named() {
    let fault = |from: &str, to: &str| parse(&TEXT3.replacen(from, to, 1)).unwrap_err();
    let unknown = fault("<Dimension valueReference=\"4\"/>", "<Dimension valueReference=\"44\"/>");
    assert!(unknown.contains("\"A\" in line 8 has a dimension of unknown size"), "{unknown}");
    let huge = fault("<Dimension start=\"3\"/>", "<Dimension start=\"99999999999\"/>");
    assert!(huge.contains("\"A\" in line 8 has more elements than are supported"), "{huge}");
    let output = fault("<Output valueReference=\"9\"", "<Output valueReference=\"99\"");
    assert!(output.contains("the value reference 99, which no variable has"), "{output}");
    let item = fault("value=\"1\"", "value=\"3000000000\"");
    assert!(item.contains("is not a whole number of 32 bits"), "{item}");
}
