-- Which store belongs to these records: the one in which this word lies. A disk that is not mounted, or another school's, has it not.
CREATE TABLE typodont.store (
  word text NOT NULL DEFAULT gen_random_uuid()::text,
  is_marked boolean NOT NULL DEFAULT false
);
INSERT INTO typodont.store DEFAULT VALUES;
GRANT SELECT ON typodont.store TO typodont_station, typodont_examiner, typodont_registrar, typodont_worker;

-- The first station that sends anything lays the word into the store.
CREATE FUNCTION typodont.store_is_marked() RETURNS void
LANGUAGE sql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$ UPDATE typodont.store SET is_marked = true $$;
REVOKE ALL ON FUNCTION typodont.store_is_marked FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.store_is_marked TO typodont_station;

-- A line in the audit log, by whoever is logged in: of what a role can do, and of anything by the owner alone. What is done by a
-- function or a trigger is written by that.
CREATE OR REPLACE FUNCTION typodont.note(action text, detail text) RETURNS void
LANGUAGE plpgsql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
  IF NOT (action = 'sessions read'
    OR action = 'exported' AND pg_has_role(session_user, 'typodont_registrar', 'MEMBER')
    OR pg_has_role(session_user, current_user, 'MEMBER')) THEN
    RAISE EXCEPTION 'nobody but the owner notes "%"', left(action, 40) USING ERRCODE = 'insufficient_privilege';
  END IF;
  INSERT INTO typodont.audit (action, detail) VALUES (action, left(detail, 1000));
END $$;
