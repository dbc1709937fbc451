"""What a tool took, and would take, in words."""

from paravol.feedback.taken_text import bite_text, taken_text


def test_the_most_is_named_first_and_dust_is_not() -> None:
    before, after = {"mucosa": 2.0}, {"mucosa": 5.0, "uncinate": 9.6, "polyp": 0.4}
    assert taken_text(before, after) == "Taken: uncinate 10 mm³, mucosa 3 mm³"
    assert taken_text(after, after) == "Nothing was taken"


def test_what_must_not_be_hurt_is_named_however_little_it_is() -> None:
    would = {"uncinate": 4.0, "septal cartilage": 0.01, "optic nerve": 0.0, "fat": 0.05}
    assert bite_text(would) == "uncinate 4 mm³, septal cartilage < 1 mm³"
    assert bite_text({"mucosa": 0.2}) == "mucosa < 1 mm³"
    assert bite_text({}) == ""
