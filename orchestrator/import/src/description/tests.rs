use super::*;

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
  <VendorAnnotations><Tool name="x"><y/></Tool></VendorAnnotations>
  <ModelVariables>
<!-- index 1 -->
<ScalarVariable name="u" valueReference="7" causality="input"><Real declaredType="Angle" start="0.5"/><Annotations><Tool name="any"><Optional/></Tool></Annotations></ScalarVariable>
<ScalarVariable name="y" valueReference="8" causality="output"><Real unit="m"/><Annotations><Tool name="z"/></Annotations></ScalarVariable>
<ScalarVariable name="kind" valueReference="9" causality="parameter" variability="fixed"><Enumeration declaredType="Kind" start="2"/></ScalarVariable>
<ScalarVariable name="z" valueReference="10" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies="1"/><Unknown index="4"/></Outputs></ModelStructure>
</fmiModelDescription>"#;

#[test]
fn later_revisions_of_the_standard_are_read_too() {
    assert!(parse(&TEXT.replace("fmiVersion=\"2.0\"", "fmiVersion=\"2.0.1\"")).is_ok());
}

#[test]
fn everything_needed_is_read() {
    let description = parse(TEXT).unwrap();
    assert!(
        description.co_simulation.as_ref().unwrap().has("canHandleVariableCommunicationStepSize")
    );
    assert!(description.co_simulation.as_ref().unwrap().has("maxOutputDerivativeOrder=1"));
    assert_eq!(description.default_experiment.stop, Some(50.0));
    assert_eq!(description.units[0].displays[0].0, "deg");
    let (_, u) = description.find("u").unwrap();
    let real = VariableKind::Real {
        unit: Some("rad".into()),
        display_unit: None,
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
fn what_cannot_be_used_is_refused() {
    let other = TEXT.replace("fmiVersion=\"2.0\"", "fmiVersion=\"3.0\"");
    assert!(parse(&other).unwrap_err().contains("FMI 3.0"));
    let index = TEXT.replace("index=\"4\"", "index=\"5\"");
    assert!(parse(&index).unwrap_err().contains("variable 5, but there are only 4"));
    let reference = TEXT.replace("valueReference=\"9\"", "valueReference=\"-1\"");
    let fault = "valueReference = \"-1\" of the element ScalarVariable \"kind\" in line 19 is not a whole number";
    assert!(parse(&reference).unwrap_err().starts_with(fault));
    let page = "<html><head/><body/></html>";
    assert!(parse(page).unwrap_err().contains("begins with the element html"));
    let version = TEXT.replace("fmiVersion=\"2.0\"", "");
    assert!(parse(&version).unwrap_err().contains("no attribute fmiVersion"));
    let untyped = TEXT.replace("<Real/>", "");
    assert!(parse(&untyped).unwrap_err().contains("\"z\" in line 20 has no type"));
    assert!(parse("<fmiModelDescription").is_err());
}
